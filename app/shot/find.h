#pragma once
#include <filesystem>

namespace app {

/// Where the shots are that go with this program: PREFIX/share/polypic/shots for PREFIX/bin/polypic, else shots/ of the
/// source tree that it was built in (a folder above it that holds shots/ and sim/). Empty when there is neither.
std::filesystem::path shots_of(const std::filesystem::path& executable);

}  // namespace app
