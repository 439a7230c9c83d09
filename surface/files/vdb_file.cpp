#include "surface/files/vdb_file.h"

#include <openvdb/io/Stream.h>

#include <cstdio>
#include <cstring>
#include <fstream>
#include <new>
#include <sstream>
#include <string_view>

#include "base/atomic_file.h"
#include "base/error.h"

namespace surface::files {
namespace {

// Header: magic (8 bytes), file version, library major and minor (4 each), seekable flag (1), then the tag as text.
constexpr std::size_t kTagOffset = 21, kTagLength = 36;
constexpr std::string_view kTagMark = "706f6c79-7069-8000-";    // starts each of our tags: "polypi" in hexadecimal, UUID version 8
constexpr std::uintmax_t kLargestFile = std::uintmax_t(1) << 37;  // [bytes]

/// Four interleaved FNV-1a sums over 8-byte words; any changed byte changes the result.
std::uint64_t checksum(std::string_view bytes) {
  constexpr std::uint64_t kPrime = 1099511628211u;
  std::uint64_t sum[4] = {14695981039346656037u, 1, 2, 3};
  std::size_t i = 0;
  for (; i + 32 <= bytes.size(); i += 32)
    for (int lane = 0; lane < 4; ++lane) {
      std::uint64_t word;
      std::memcpy(&word, bytes.data() + i + 8 * lane, 8);
      sum[lane] = (sum[lane] ^ word) * kPrime;
      sum[lane] ^= sum[lane] >> 29;
    }
  for (; i < bytes.size(); ++i) sum[0] = (sum[0] ^ static_cast<unsigned char>(bytes[i])) * kPrime;
  std::uint64_t all = bytes.size();
  for (const std::uint64_t s : sum) all = (all ^ s) * kPrime, all ^= all >> 32;
  return all;
}

/// The tag of a file whose bytes, without the tag itself, are these.
std::string tag_of(std::string_view bytes) {
  const std::uint64_t sum = checksum(bytes.substr(kTagOffset + kTagLength)) ^ checksum(bytes.substr(0, kTagOffset));
  char digits[17];
  std::snprintf(digits, sizeof digits, "%016llx", static_cast<unsigned long long>(sum));
  std::string tag(kTagMark);                         // 8-4-4- of 8-4-4-4-12; 16 digits follow
  tag += std::string(digits, 4) + "-" + std::string(digits + 4, 12);
  return tag;
}

/// OpenVDB's own writer into a stream we can check; seekable, so that others may load grids one by one.
struct Archive : openvdb::io::Archive {
  void put(std::ostream& out, const openvdb::GridCPtrVec& grids, const openvdb::MetaMap& metadata) const {
    write(out, grids, /*seekable=*/true, metadata);
  }
};

}  // namespace

void write(const std::filesystem::path& path, const openvdb::GridCPtrVec& grids, const openvdb::MetaMap& metadata) {
  std::ostringstream out(std::ios::binary);
  out.exceptions(std::ios::failbit | std::ios::badbit);   // else a stream that finds no memory drops what comes, and says nothing
  Archive archive;
  archive.setCompression(openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ACTIVE_MASK);
  archive.put(out, grids, metadata);
  std::string bytes = std::move(out).str();
  bytes.replace(kTagOffset, kTagLength, tag_of(bytes));
  base::write_atomically(path, [&](const std::filesystem::path& temporary) {
    std::ofstream file(temporary, std::ios::binary);
    file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    file.close();
    if (!file) base::throw_io(path.string(), "cannot write " + std::to_string(bytes.size()) + " bytes");
  });
}

Contents read(const std::filesystem::path& path) {
  std::string bytes = base::read_file(path, kLargestFile);
  std::int64_t magic = 0;
  if (bytes.size() >= sizeof magic) std::memcpy(&magic, bytes.data(), sizeof magic);
  if (magic != openvdb::OPENVDB_MAGIC) base::throw_input(path.string(), bytes.empty() ? "the file is empty" : "not an OpenVDB file");
  if (bytes.size() < kTagOffset + kTagLength) base::throw_input(path.string(), "the file is cut short");
  const std::string tag = bytes.substr(kTagOffset, kTagLength);
  const bool is_ours = tag.starts_with(kTagMark);
  if (is_ours && tag != tag_of(bytes))
    base::throw_input(path.string(), "the file is damaged or cut short (its checksum does not match)");
  Contents contents;
  try {
    std::istringstream in(std::move(bytes), std::ios::binary);
    in.exceptions(std::ios::failbit | std::ios::badbit);
    openvdb::io::Stream stream(in, /*delayLoad=*/false);
    contents.grids = *stream.getGrids();
    contents.metadata = stream.getMetadata();
  } catch (const std::ios_base::failure&) {
    base::throw_input(path.string(), "the file is cut short");
  } catch (const std::bad_alloc&) {
    if (is_ours) throw;   // whole, so memory is what lacks
    base::throw_input(path.string(), "does not fit into memory");
  } catch (const std::exception& e) {
    base::throw_input(path.string(), std::string("cannot be read: ") + e.what());
  }
  return contents;
}

}  // namespace surface::files
