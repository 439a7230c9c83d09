#pragma once
// What the declarations say of a key, whatever a shot holds. `key` may name entries: body.column.velocity, look.water.ior.
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "app/shot/shot.h"

namespace app {

/// What must hold where the key applies, as `kind = "area"`; nothing where no key is called so.
std::optional<std::vector<std::string>> needs_of(const std::string& key);
/// "m/s"; empty when the key is not declared or a unit makes no sense.
std::string declared_unit(const std::string& key);
/// The keys of a table that is no shot's: "problem.waves".
std::vector<KeyRow> keys_of(const std::string& table, const std::function<void(base::Params&)>& declaration);
/// "shot.fps" for "fps"; empty when there is none.
std::string declared_key_ending_in(std::string_view name);

}  // namespace app
