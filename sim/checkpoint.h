#pragma once
// The exact state of a simulation in a file, from which it goes on to the bit. HDF5: root attributes schema, frame, hash and
// version, one dataset a column with the attribute checksum. The file's first 512 bytes (HDF5's user block) say its length and
// the checksum of all that follows, so that damage is found before any of it is interpreted.
#include <filesystem>
#include <string>

#include "sim/state.h"

namespace sim {

struct Checkpoint {
  std::string hash;      // of the keys that the simulation reads
  std::string version;   // of the program that wrote it
  State state;           // columns in the order of their names
};

/// Atomic; the same bytes for the same state. Throws base::Error (exit 5).
void write_checkpoint(const std::filesystem::path&, const std::string& hash, const std::string& version, const State&);

/// Throws base::Error ("PATH: reason", exit 2) for a file that is missing, foreign, cut short or damaged, before more is
/// allocated than the file is long.
Checkpoint read_checkpoint(const std::filesystem::path&);

}  // namespace sim
