#pragma once
// .vdb files in memory and on disk: whole, checked, and with the same bytes whenever the grids are the same.
#include <openvdb/openvdb.h>

#include <filesystem>

namespace surface::files {

struct Contents {
  openvdb::GridPtrVec grids;
  openvdb::MetaMap::Ptr metadata;
};

/// Blosc and active mask, written atomically. The header's unique tag, random in OpenVDB, is a checksum of the contents here.
void write(const std::filesystem::path&, const openvdb::GridCPtrVec&, const openvdb::MetaMap&);

/// All grids of a file. A missing, foreign, truncated or damaged file throws base::Error ("PATH: reason", exit 2).
Contents read(const std::filesystem::path&);

/// The grid with this name and type, or null.
template <class Grid>
typename Grid::Ptr find(const Contents& contents, const std::string& name) {
  for (const auto& grid : contents.grids)
    if (grid->getName() == name && grid->isType<Grid>()) return openvdb::gridPtrCast<Grid>(grid);
  return nullptr;
}

}  // namespace surface::files
