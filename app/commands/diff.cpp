#include <cstdio>
#include <nlohmann/json.hpp>

#include "app/commands/commands.h"
#include "app/compare/compare.h"
#include "base/text.h"

namespace app {
namespace {

using Json = nlohmann::ordered_json;

std::string text(const Json& value) { return value.is_string() ? value.get<std::string>() : value.dump(); }

/// "0.00123", or "-" where there is no such value.
std::string number(const Json& values, const char* name, const char* unit = "") {
  if (!values.contains(name)) return "-";
  char written[48];
  std::snprintf(written, sizeof written, "%.4g%s", values[name].get<double>(), unit);
  return written;
}

constexpr int kName = 14, kColumn = 12;   // [characters]

void print_heads(const char* first, const std::string& over) {
  std::printf("%-*s%*s%*s%*s%*s\n", kName, first, kColumn, "mean", kColumn, "rms", kColumn, "max", kColumn, over.c_str());
}

void print_values(const std::string& name, const Json& values) {
  std::printf("%-*s", kName, name.c_str());
  for (const char* column : {"mean", "rms", "max"}) std::printf("%*s", kColumn, number(values, column).c_str());
  std::printf("%*s\n", kColumn, number(values, "percent_over", " %").c_str());
  if (values.contains("not_finite")) std::printf("  %s not finite\n", text(values["not_finite"]).c_str());
}

void print_unlike(const Json& values) {
  for (const Json& what : values.value("unlike", Json::array())) std::printf("  other %s\n", text(what).c_str());
}

std::string over_text(const Tolerance& tolerance) { return "over " + base::to_text(tolerance.fail); }

void print_image(const Json& out, const Tolerance& tolerance) {
  print_heads("channel", over_text(tolerance));
  for (const Json& channel : out["channels"]) print_values(text(channel["name"]), channel);
  print_values("all", out);   // over: pixels of which any channel is
  if (out.contains("psnr")) std::printf("psnr %s\n", number(out, "psnr", " dB").c_str());
  if (!out.contains("picture")) return;
  std::string channels;
  for (const Json& channel : out["picture"]["channels"]) channels += " " + text(channel);
  std::printf("picture %s: difference of%s times %s\n", text(out["picture"]["file"]).c_str(), channels.c_str(),
              number(out["picture"], "gain").c_str());
}

void print_volume(const Json& out, const Tolerance& tolerance) {
  print_heads("grid", over_text(tolerance));
  for (const Json& grid : out["grids"]) {
    print_values(text(grid["name"]) + (grid.contains("unit") ? " [" + text(grid["unit"]) + "]" : ""), grid);
    std::printf("  active %s and %s voxels", text(grid["active"][0]).c_str(), text(grid["active"][1]).c_str());
    if (grid.contains("active_only"))
      std::printf(", in one only %s and %s", text(grid["active_only"][0]).c_str(), text(grid["active_only"][1]).c_str());
    std::printf("\n");
    print_unlike(grid);
  }
  for (const char* side : {"only_a", "only_b"})
    for (const Json& name : out.value(side, Json::array()))
      std::printf("%-*s  in the %s file only\n", kName, text(name).c_str(), side[5] == 'a' ? "first" : "second");
}

void print_points(const Json& out, const Tolerance& tolerance) {
  print_heads("", over_text(tolerance));
  print_values("position [m]", out["position"]);
  print_values("velocity [m/s]", out["velocity"]);
  std::printf("%s and %s points, in one only %s and %s\n", text(out["count"][0]).c_str(), text(out["count"][1]).c_str(), text(out["only"][0]).c_str(),
              text(out["only"][1]).c_str());
  print_unlike(out);
}

/// "frame 12: kinetic_energy 0.0012, relative"
std::string worst_text(const Json& worst) {
  std::string line = "frame " + text(worst["frame"]);
  if (worst.contains("quantity")) line += ": " + text(worst["quantity"]) + (worst.contains("max") ? " " + number(worst, "max") + ", relative" : "");
  else if (worst.contains("position")) line += ": " + number(worst["position"], "max", " m") + ", " + number(worst["velocity"], "max", " m/s");
  else if (worst.contains("grids"))
    for (const Json& grid : worst["grids"])
      line += (&grid == &worst["grids"][0] ? ": " : ", ") + text(grid["name"]) + " " +
              number(grid, "max", grid.contains("unit") ? (" " + text(grid["unit"])).c_str() : "");
  else if (worst.contains("unlike")) line += ": " + text(worst["unlike"]);
  else line += ": " + number(worst, "max") + (worst.contains("psnr") ? ", psnr " + number(worst, "psnr", " dB") : "");
  return line;
}

void print_run(const Json& out) {
  std::printf("%-*s%8s%8s%8s  %s\n", kName, "stage", "frames", "differ", "first", "largest difference");
  for (const Json& stage : out["stages"]) {
    std::printf("%-*s%8s%8s%8s  %s\n", kName, text(stage["stage"]).c_str(), text(stage["frames"]).c_str(), text(stage["differ"]).c_str(),
                stage.contains("first") ? text(stage["first"]).c_str() : "-", stage.contains("worst") ? worst_text(stage["worst"]).c_str() : "-");
    for (const char* side : {"only_a", "only_b"})
      if (stage.contains(side))
        std::printf("  %zu in the %s run only: %s\n", stage[side].size(), side[5] == 'a' ? "first" : "second", text(stage[side]).c_str());
  }
}

void print(const Json& out, const Tolerance& tolerance) {
  const std::string kind = out["kind"];
  if (kind == "image") print_image(out, tolerance);
  else if (kind == "volume") print_volume(out, tolerance);
  else if (kind == "points") print_points(out, tolerance);
  else print_run(out);
  const std::string within =
      tolerance.exact() ? "" : " within " + base::to_text(tolerance.fail) + ", " + base::to_text(tolerance.percent) + " % excepted";
  std::printf("%s%s", out["same"].get<bool>() ? "same" : "differ", within.c_str());
  if (out.contains("first")) std::printf(": first in frame %s, %s", text(out["first"]["frame"]).c_str(), text(out["first"]["stage"]).c_str());
  std::printf("\n");
}

}  // namespace

bool diff(const Request& request) {
  const Tolerance tolerance{.fail = request.fail, .percent = request.fail_percent};
  const Json out = compare(request.subject, request.other, tolerance, request.out);
  Json document = {{"schema", 1}};
  document.update(out);
  if (request.json) std::printf("%s\n", document.dump(2, ' ', false, Json::error_handler_t::replace).c_str());
  else print(out, tolerance);
  return out["same"].get<bool>();
}

}  // namespace app
