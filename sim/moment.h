#pragma once
// Copies of what a step changes, to go back to within a frame (Simulation::moment).
#include <tuple>
#include <type_traits>

#include "sim/simulation.h"

namespace sim {

template <class Values>
struct KeptMoment final : Simulation::Moment {
  explicit KeptMoment(Values v) : values(std::move(v)) {}
  Values values;
};

/// Of the members that a tuple refers to.
template <class... Member>
std::unique_ptr<Simulation::Moment> keep_moment(const std::tuple<Member&...>& members) {
  using Values = std::tuple<std::remove_const_t<Member>...>;
  return std::make_unique<KeptMoment<Values>>(Values(members));
}

/// Back into the same members.
template <class... Member>
void put_back(const Simulation::Moment& moment, std::tuple<Member&...> members) {
  members = dynamic_cast<const KeptMoment<std::tuple<Member...>>&>(moment).values;
}

}  // namespace sim
