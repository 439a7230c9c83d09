#pragma once
// What the declarations say of a key, whatever a shot holds. `key` may name entries: body.column.velocity, look.water.ior.
#include <string>
#include <string_view>

namespace app {

bool is_declared_key(const std::string& key);
/// "m/s"; empty when the key is not declared or a unit makes no sense.
std::string declared_unit(const std::string& key);
/// "shot.fps" for "fps"; empty when there is none.
std::string declared_key_ending_in(std::string_view name);

}  // namespace app
