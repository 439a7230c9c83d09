#pragma once
// Which program this is. The definitions are generated at build time.

namespace app {

extern const char* const kVersion;   // "0.3.0"
extern const char* const kCommit;    // abbreviated, "-dirty" when the tree had changes; empty outside a repository

}  // namespace app
