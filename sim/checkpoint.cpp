// The only file that knows HDF5. The library lays the file out; the columns' bytes are written past it, so that a full disk is met
// by calls whose errors are clear and not by the library's caches.
#include "sim/checkpoint.h"

#include <fcntl.h>
#include <hdf5.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cinttypes>
#include <cstdio>
#include <optional>
#include <system_error>

#include "base/atomic_file.h"
#include "base/checksum.h"
#include "base/error.h"

namespace sim {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kSchema = 1;
constexpr std::uint64_t kUserBlock = 512;      // [bytes] the smallest that HDF5 allows
constexpr std::uint64_t kLayout = 1 << 16;     // [bytes] more than HDF5's own part of the file
constexpr hsize_t kMostColumns = 256;
constexpr std::size_t kLongestText = 256;

/// An HDF5 object, closed at the end. A failed call gives one that is not good().
class Handle {
 public:
  Handle(hid_t id, herr_t (*closing)(hid_t)) : id_(id), close_(closing) {}
  ~Handle() {
    if (good()) close_(id_);
  }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  bool good() const { return id_ >= 0; }
  operator hid_t() const { return id_; }
  /// Closes now; false when that failed.
  bool close() {
    const herr_t done = close_(id_);
    id_ = -1;
    return done >= 0;
  }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

// Errors are ours to tell, and nothing is left for the library to do at exit.
void prepare_library() {
  H5dont_atexit();
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
}

hid_t file_type(Column::Type type) {
  switch (type) {
    case Column::Type::int32: return H5T_STD_I32LE;
    case Column::Type::int64: return H5T_STD_I64LE;
    case Column::Type::float32: return H5T_IEEE_F32LE;
    case Column::Type::float64: break;
  }
  return H5T_IEEE_F64LE;
}

std::uint64_t size_of(Column::Type type) { return type == Column::Type::int32 || type == Column::Type::float32 ? 4 : 8; }

std::string reason(int code) { return std::system_category().message(code); }

// --- writing --------------------------------------------------------------------------------------------------------

bool put_attribute(hid_t object, const char* name, hid_t type, const void* value) {
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose);
  const Handle attribute(H5Acreate2(object, name, type, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  return attribute.good() && H5Awrite(attribute, type, value) >= 0;
}

bool put_text(hid_t object, const char* name, const std::string& text) {
  const Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
  return H5Tset_size(type, text.size() + 1) >= 0 && put_attribute(object, name, type, text.c_str());
}

/// Makes room for a column and gives its place in the file; nothing for a column without rows.
bool lay_out(hid_t file, const Column& column, std::optional<haddr_t>& place) {
  const std::array<hsize_t, 2> extent{hsize_t(column.rows), hsize_t(column.width)};
  const Handle space(H5Screate_simple(2, extent.data(), nullptr), H5Sclose);
  const Handle creation(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  H5Pset_layout(creation, H5D_CONTIGUOUS);
  H5Pset_alloc_time(creation, H5D_ALLOC_TIME_EARLY);
  H5Pset_fill_time(creation, H5D_FILL_TIME_NEVER);
  H5Pset_obj_track_times(creation, false);
  const Handle set(H5Dcreate2(file, column.name.c_str(), file_type(column.type), space, H5P_DEFAULT, creation, H5P_DEFAULT), H5Dclose);
  const std::uint64_t sum = base::checksum(column.bytes);
  if (!set.good() || !put_attribute(set, "checksum", H5T_STD_U64LE, &sum)) return false;
  if (column.bytes.empty()) return true;
  place = H5Dget_offset(set);
  return *place != HADDR_UNDEF;
}

/// The file without the columns' bytes; empty when the library could not write it.
std::optional<std::vector<std::optional<haddr_t>>> lay_out(const fs::path& path, const std::string& hash, const std::string& version,
                                                           const State& state) {
  const Handle creation(H5Pcreate(H5P_FILE_CREATE), H5Pclose), access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  H5Pset_userblock(creation, kUserBlock);
  H5Pset_obj_track_times(creation, false);
  H5Pset_file_locking(access, false, true);   // the file is nobody else's yet, and not every disk has locks
  Handle file(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, creation, access), H5Fclose);
  if (!file.good()) return {};
  std::vector<std::optional<haddr_t>> places(state.columns.size());
  bool well = put_attribute(file, "schema", H5T_STD_I64LE, &kSchema) && put_attribute(file, "frame", H5T_STD_I64LE, &state.frame) &&
              put_text(file, "hash", hash) && put_text(file, "version", version);
  for (std::size_t i = 0; i < places.size() && well; ++i) well = lay_out(file, state.columns[i], places[i]);
  if (!file.close() || !well) return {};
  return places;
}

/// An open file whose every call is checked; `path` is what errors call it.
class Output {
 public:
  Output(const fs::path& file, const fs::path& path) : path_(path), descriptor_(::open(file.c_str(), O_RDWR | O_CLOEXEC)) {
    if (descriptor_ < 0) base::throw_io(path_.string(), reason(errno));
  }
  ~Output() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  Output(const Output&) = delete;
  Output& operator=(const Output&) = delete;
  void reserve(std::uint64_t bytes) const {
    if (const int failure = ::posix_fallocate(descriptor_, 0, off_t(bytes))) base::throw_io(path_.string(), reason(failure));
  }
  void write(const void* from, std::uint64_t bytes, std::uint64_t at) const {
    for (const char* next = static_cast<const char*>(from); bytes > 0;) {
      const ssize_t done = ::pwrite(descriptor_, next, bytes, off_t(at));
      if (done < 0 && errno == EINTR) continue;
      if (done <= 0) base::throw_io(path_.string(), reason(done < 0 ? errno : EIO));
      next += done, at += std::uint64_t(done), bytes -= std::uint64_t(done);
    }
  }
  void close() {
    const int descriptor = descriptor_;
    descriptor_ = -1;
    if (::close(descriptor) != 0) base::throw_io(path_.string(), reason(errno));
  }

 private:
  const fs::path& path_;
  int descriptor_;
};

std::array<char, kUserBlock> user_block(const base::FileSum& sum) {
  std::array<char, kUserBlock> text{};
  std::snprintf(text.data(), text.size(), "polypic checkpoint\nbytes %" PRIu64 "\nchecksum %016" PRIx64 "\n", sum.bytes, sum.checksum);
  return text;
}

// --- reading --------------------------------------------------------------------------------------------------------

[[noreturn]] void refuse(const fs::path& path, const std::string& why) { base::throw_input(path.string(), why); }
constexpr auto kForeign = "is no checkpoint";

// The file's own word on its bytes, against the bytes.
void check_bytes(const fs::path& path) {
  std::array<char, kUserBlock + 1> start{};
  std::error_code none;
  if (const auto status = fs::status(path, none); fs::exists(status) && !fs::is_regular_file(status)) refuse(path, "is not a file");
  std::FILE* const file = std::fopen(path.c_str(), "rb");
  if (!file) refuse(path, reason(errno));
  const std::size_t got = std::fread(start.data(), 1, kUserBlock, file);
  std::fclose(file);
  if (got == 0) refuse(path, "is empty");
  base::FileSum said;
  if (std::sscanf(start.data(), "polypic checkpoint\nbytes %" SCNu64 "\nchecksum %" SCNx64, &said.bytes, &said.checksum) != 2) refuse(path, kForeign);
  if (!std::equal(start.begin(), start.begin() + std::ptrdiff_t(got), user_block(said).begin())) refuse(path, "is damaged");
  const std::optional<base::FileSum> is = got == kUserBlock ? base::sum_of(path, kUserBlock) : base::FileSum{};
  if (!is) refuse(path, "cannot be read");
  if (is->bytes < said.bytes) refuse(path, "is cut short");
  if (*is != said) refuse(path, "is damaged (its checksum does not match)");
}

bool get_attribute(hid_t object, const char* name, hid_t type, void* value) {
  const Handle attribute(H5Aopen(object, name, H5P_DEFAULT), H5Aclose);
  if (!attribute.good()) return false;
  const Handle space(H5Aget_space(attribute), H5Sclose), stored(H5Aget_type(attribute), H5Tclose);
  return H5Sget_simple_extent_npoints(space) == 1 && H5Tequal(stored, type) > 0 && H5Aread(attribute, type, value) >= 0;
}

bool get_text(hid_t object, const char* name, std::string& text) {
  const Handle attribute(H5Aopen(object, name, H5P_DEFAULT), H5Aclose);
  if (!attribute.good()) return false;
  const Handle space(H5Aget_space(attribute), H5Sclose), type(H5Aget_type(attribute), H5Tclose);
  const std::size_t size = H5Tget_size(type);
  if (H5Sget_simple_extent_npoints(space) != 1 || H5Tget_class(type) != H5T_STRING || H5Tis_variable_str(type) != 0 || size > kLongestText)
    return false;
  std::array<char, kLongestText + 1> value{};
  if (H5Aread(attribute, type, value.data()) < 0) return false;
  text = value.data();
  return true;
}

std::optional<Column::Type> column_type_of(hid_t stored) {
  for (const auto type : {Column::Type::int32, Column::Type::int64, Column::Type::float32, Column::Type::float64})
    if (H5Tequal(stored, file_type(type)) > 0) return type;
  return {};
}

/// False for anything that is not a column of ours with the checksum it had. `limit`: bytes that a column can have at most.
bool read_column(hid_t file, std::uint64_t limit, Column& column) {
  const Handle set(H5Dopen2(file, column.name.c_str(), H5P_DEFAULT), H5Dclose);
  if (!set.good()) return false;
  const Handle space(H5Dget_space(set), H5Sclose), stored(H5Dget_type(set), H5Tclose);
  const std::optional<Column::Type> type = column_type_of(stored);
  std::array<hsize_t, 2> extent{};
  if (!type || H5Sget_simple_extent_ndims(space) != 2 || H5Sget_simple_extent_dims(space, extent.data(), nullptr) != 2) return false;
  const auto [rows, width] = extent;
  if (width == 0 || width > limit || rows > limit / (width * size_of(*type))) return false;
  column.type = *type;
  column.rows = std::int64_t(rows);
  column.width = std::int64_t(width);
  column.bytes.resize(rows * width * size_of(*type));
  std::uint64_t sum = 0;
  return (rows == 0 || H5Dread(set, file_type(*type), H5S_ALL, H5S_ALL, H5P_DEFAULT, column.bytes.data()) >= 0) &&
         get_attribute(set, "checksum", H5T_STD_U64LE, &sum) && sum == base::checksum(column.bytes);
}

bool read_columns(hid_t file, std::uint64_t limit, std::vector<Column>& columns) {
  H5G_info_t group{};
  if (H5Gget_info(file, &group) < 0 || group.nlinks > kMostColumns) return false;
  for (hsize_t i = 0; i < group.nlinks; ++i) {
    H5L_info_t link{};
    std::array<char, kLongestText> name{};
    if (H5Lget_info_by_idx(file, ".", H5_INDEX_NAME, H5_ITER_INC, i, &link, H5P_DEFAULT) < 0 || link.type != H5L_TYPE_HARD) return false;
    const auto length = H5Lget_name_by_idx(file, ".", H5_INDEX_NAME, H5_ITER_INC, i, name.data(), name.size(), H5P_DEFAULT);
    if (length <= 0 || std::size_t(length) >= name.size()) return false;
    columns.push_back({.name = name.data(), .bytes = {}});
    if (!read_column(file, limit, columns.back())) return false;
  }
  return true;
}

}  // namespace

void write_checkpoint(const fs::path& path, const std::string& hash, const std::string& version, const State& state) {
  prepare_library();
  std::uint64_t room = kLayout;
  for (const Column& column : state.columns) room += column.bytes.size();
  base::write_atomically(path, [&](const fs::path& temporary) {
    Output(temporary, path).reserve(room);   // a disk too full shows here
    errno = 0;
    const auto places = lay_out(temporary, hash, version, state);
    if (!places) base::throw_io(path.string(), errno != 0 ? reason(errno) : "HDF5 cannot write it");
    Output file(temporary, path);
    for (std::size_t i = 0; i < places->size(); ++i)
      if (const auto& place = (*places)[i]) file.write(state.columns[i].bytes.data(), state.columns[i].bytes.size(), *place);
    file.write(user_block(base::sum_of_written(temporary, path, kUserBlock)).data(), kUserBlock, 0);
    file.close();
  });
}

Checkpoint read_checkpoint(const fs::path& path) {
  check_bytes(path);
  prepare_library();
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  H5Pset_file_locking(access, false, true);
  const Handle file(H5Fopen(path.c_str(), H5F_ACC_RDONLY, access), H5Fclose);
  if (!file.good()) refuse(path, kForeign);
  std::int64_t schema = 0;
  Checkpoint out;
  if (!get_attribute(file, "schema", H5T_STD_I64LE, &schema)) refuse(path, kForeign);
  if (schema != kSchema) refuse(path, "has schema " + std::to_string(schema) + "; this program reads " + std::to_string(kSchema));
  if (!get_attribute(file, "frame", H5T_STD_I64LE, &out.state.frame) || !get_text(file, "hash", out.hash) || !get_text(file, "version", out.version))
    refuse(path, kForeign);
  std::error_code none;
  if (!read_columns(file, fs::file_size(path, none), out.state.columns)) refuse(path, "is damaged (a column is not what it was)");
  return out;
}

}  // namespace sim
