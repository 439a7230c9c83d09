#pragma once
// A shot file, read: TOML -> layers merged -> every key checked -> plain structs.
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/shot/tree.h"
#include "render/render.h"
#include "sim/scene.h"
#include "surface/surface.h"

namespace app {

struct Shot {
  std::string name;             // the file's stem
  std::filesystem::path file;
  std::filesystem::path folder; // that its relative paths start from: the file's own, or that of the shot which a run's copy is of
  std::int64_t frames = 24;
  double fps = 24;              // [1/s]
  std::string quality = "normal";
  bool has_pictures = false;    // whether there is a [render]
  std::int64_t checkpoint_every = 10, checkpoint_keep = 2;   // [frames], [1]
  sim::Scene scene;
  surface::Options surface;
  render::Setting render;
  /// The shot as run: rung, quality table and overrides applied; only keys that somebody set, canonical order and spelling.
  std::string resolved;
  /// Every key with its value as TOML, defaults included: "body.column.velocity". An optional that is unset is absent.
  std::vector<std::pair<std::string, std::string>> values;
  Node written;   // what `resolved` is the text of, each value with the place it came from
  void params(base::Params&);
};

/// An error about a key of the shot, where its value was given: file, line and column, or --set KEY=VALUE; of a default the file alone.
base::Error error_about(const Shot&, base::Complaint);

/// "PolyPIC full linear reflection", "APIC quadratic": for captions.
std::string transfer_text(const sim::Options&);

/// What the command line adds to a file.
struct Overrides {
  std::optional<std::string> quality;
  std::vector<std::string> sets;   // "key=value"
};

/// Precedence: default < built-in rung < the shot's key < the shot's own [quality.RUNG] < --set.
/// Throws base::Error (exit 2) with file, line, column, key, value and what is allowed.
Shot read_shot(const std::filesystem::path&, const Overrides&);
/// The same, but files that the shot names are not read and need not be there: for who asks for its keys, as a run keeps them, and makes nothing.
Shot read_shot_alone(const std::filesystem::path&, const Overrides&);

/// SHOT of the command line: a file, or the name of a shipped shot. Throws "PATH: reason" (exit 2) when there is neither.
std::filesystem::path find_shot(const std::string& shot);
/// Where shipped shots are: beside the program's install, or in the source tree.
std::vector<std::filesystem::path> shipped_shots();

/// One key as declared, for the `params` command and the documentation.
struct KeyRow {
  std::string key;              // "sim.cell", "body.NAME.velocity", "look.NAME.ior"
  std::string default_value, unit, allowed, meaning;
  std::vector<std::string> needs = {};  // what must hold where it applies: kind = "area"
  std::string default_of_solids = {};   // with sim.solver = "solid"; empty where it is the same
};
std::vector<KeyRow> all_keys();
/// A complete small shot that runs, with every key that matters and a comment each.
std::string example_shot();

/// A key and its value as text in two shots; empty in the one that does not have it.
struct ChangedKey {
  std::string key, before, now;
};
/// What `stage` ("simulate", "surface", "render", "preview") reads otherwise in `now` than in the shot that `resolved_before` is the text of;
/// first the quality, where that is another.
/// Throws base::Error when that is no shot.
std::vector<ChangedKey> changed_keys(const std::string& resolved_before, const Shot& now, const std::string& stage);

/// Meshes and pictures that the shot is made from.
std::vector<std::filesystem::path> named_files(const Shot&);

/// What a run in `out` keeps of its shot: `resolved`, and before it, where it names files, a comment by which read_shot finds them from there.
std::string copy_of(const Shot&, const std::filesystem::path& out);

/// Whether a text is such a copy of some shot, and nobody's own writing.
bool is_resolved(const std::string& text);

/// Canonical text of the keys one stage reads, for its hash: "simulate", "surface", "render" or "preview"; defaults, and the looks and lights
/// that come with the program, are written out.
std::string stage_text(const Shot&, const std::string& stage);

}  // namespace app
