#pragma once
// Later stages: points file -> level set file -> image files, and points file -> preview.
#include <cstdint>
#include <memory>

#include "app/shot/shot.h"
#include "app/stages/folder.h"
#include "app/stages/hash.h"
#include "app/stages/stopwatch.h"
#include "render/render.h"

namespace app {

/// Makes one frame's files of a stage from the file upstream, and its record. Each returns the seconds spent.
class PictureMaker {
 public:
  PictureMaker(const Shot&, const Folder&, StageHashes, int threads);
  double surface(std::int64_t frame);
  double render(std::int64_t frame);
  double preview(std::int64_t frame);

 private:
  /// Path traced from the surface; in two dimensions, and for previews, drawn.
  render::Image trace(std::int64_t frame, base::Ledger&);
  render::Image draw(std::int64_t frame, base::Ledger&) const;
  bool is_flat() const { return shot_.scene.options.dimension == 2; }
  void record(Stage, std::int64_t frame, const base::Ledger&, const Stopwatch& spent) const;

  const Shot& shot_;
  const Folder& folder_;
  StageHashes hashes_;
  int threads_;
  /// What pictures depend on, with the colliders where they are at a frame.
  render::Setting setting_at(std::int64_t frame) const;
  bool colliders_move() const;
  std::unique_ptr<render::PathTracer> tracer_;   // built for the first frame that is rendered; anew for each where colliders move
};

}  // namespace app
