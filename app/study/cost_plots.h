#pragma once
// The plots of a study.
#include <optional>
#include <vector>

#include "app/study/plot.h"
#include "app/study/study.h"

namespace app {

/// The variants of a case that ran, in the order of the ladder.
std::vector<const Variant*> variants_of(const Study&, const StudyCase&);

/// The error of one kind against seconds, with the front of those that nothing beats; empty when fewer than two variants have that error.
std::optional<Plot> error_plot(const Study&, const StudyCase&, Measure);
/// Energy, or enstrophy, over time; empty when no variant has it.
std::optional<Plot> energy_plot(const Study&, const StudyCase&);
std::optional<Plot> enstrophy_plot(const Study&, const StudyCase&);
/// Bars: seconds by pass; change of the energy by stage.
std::optional<Plot> seconds_plot(const Study&, const StudyCase&);
std::optional<Plot> losses_plot(const Study&, const StudyCase&);

}  // namespace app
