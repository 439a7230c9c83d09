#pragma once
// Frames of some stages in one directory, and what must hold before they are made.
#include <string>
#include <vector>

#include "app/stages/film.h"
#include "app/stages/finished.h"

namespace app {

struct Making {
  const Shot& shot;
  const Order& order;
  Folder folder;
  StageHashes hashes;
  FrameRange range;

  std::int64_t dimension() const { return shot.scene.options.dimension; }
  bool wants(Stage) const;
  /// Whether a stage of this shot has frames of `upstream` in its own.
  bool stands_on(Stage, Stage upstream) const;
  /// Whether previews show the surface: they stand on it then, too.
  bool previews_surface() const;
  /// Those asked for; a simulation has to pass through all before.
  std::vector<std::int64_t> frames() const;
};

/// Stages that are made again although they have frames, and the keys that changed: "surface, render (surface.voxel changed)".
/// Empty when nothing changed. Throws base::Error (exit 4) naming the key where a stage upstream of those asked for, or the
/// simulation, was made with other keys.
std::string made_again(const Making&);

/// Whether the directory's shot.toml has other keys than this shot for a stage that is asked for.
bool reads_otherwise(const Making&);

/// Every unfinished frame needs its predecessor's file, whole and from the same shot, unless that is made on the way.
/// Throws base::Error: exit 2 naming the file and what to run, 4 where it is of another shot.
void check_upstream(const Making&, Finished&);

/// A simulation goes on with the program that began it; throws base::Error (exit 4) with the key program.version.
void check_version(const Making&);

}  // namespace app
