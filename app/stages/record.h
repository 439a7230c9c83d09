#pragma once
// What is known of one finished frame and stage: ledger/STAGE.0001.json, written after its files. run.json is assembled
// from these records.
#include <cstdint>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "app/shot/shot.h"
#include "app/stages/folder.h"
#include "base/ledger.h"
#include "sim/frame.h"

namespace app {

struct Record {
  struct File {
    std::string name = {};      // relative to the run's directory
    std::uint64_t bytes = 0;
    std::string checksum = {};  // base/checksum.h, 16 hexadecimal digits
    bool operator==(const File&) const = default;
  };
  Stage stage = Stage::simulate;
  std::int64_t frame = 1;
  std::string hash = {};        // of the shot's keys that the stage reads
  std::string version = {};     // of the program
  std::optional<File> source = {};  // upstream: what it was made from
  std::vector<File> files = {};
  double seconds = 0;          // wall clock
  double cpu_seconds = 0;      // of all threads
  std::int64_t peak_bytes = 0; // resident memory of the process so far
  std::map<std::string, base::PassCost, std::less<>> passes = {};
  std::map<std::string, std::int64_t, std::less<>> attributes = {};   // bytes that all particles hold: simulate only
  std::optional<sim::Totals> totals = {};   // simulate only
};

/// {"name", "bytes", "checksum"}
nlohmann::ordered_json file_json(const Record::File&);
/// A file of the run as it is now; empty when it cannot be read.
std::optional<Record::File> measure(const Folder&, const std::filesystem::path& file);
/// The same of a file just written; throws base::Error (exit 5) with the reason when it cannot be read.
Record::File measure_written(const Folder&, const std::filesystem::path& file);

/// Measures the frame's files, what they were made from, and memory, and writes the record.
void write_record(const Folder&, std::int64_t dimension, Record);
/// The record, if the frame is finished: made from keys with this hash, by this program (a simulation: by any) and from what is
/// upstream now, and every file there with the size it had.
std::optional<Record> finished_record(const Folder&, std::int64_t dimension, Stage, std::int64_t frame, const std::string& hash);
/// Names of the record's files that have other bytes than it says, read to the last.
std::vector<std::string> damaged_files(const Folder&, const Record&);
/// The record as it stands, finished or not; empty when there is none of this frame that can be read.
std::optional<Record> read_record(const Folder&, Stage, std::int64_t frame);

/// Content of run.json: all frames with a finished stage.
nlohmann::ordered_json run_document(const Folder&, const Shot&, int threads);

}  // namespace app
