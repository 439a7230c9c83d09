#include "app/plan/graph.h"

#include <algorithm>
#include <map>
#include <vector>

#include "app/plan/plan.h"
#include "app/study/text.h"

namespace app {
namespace {

// Lengths in SVG units. Passes run down the page; data stand beside them as vertical lines, from who writes them first to who reads them last.
constexpr int kRow = 34, kTop = 78, kLeft = 130, kBox = 130, kFirstLine = kLeft + kBox + 46, kColumn = 92, kMargin = 30;

struct Placed {
  std::string stage;
  base::PassRow pass;
  int y = 0;
};

std::string number(int n) { return std::to_string(n); }

std::string text(int x, int y, const std::string& content, const std::string& more) {
  return "<text x=\"" + number(x) + "\" y=\"" + number(y) + "\" " + more + ">" + html_text(content) + "</text>\n";
}

std::string line(int x1, int y1, int x2, int y2, const std::string& more) {
  return "<line x1=\"" + number(x1) + "\" y1=\"" + number(y1) + "\" x2=\"" + number(x2) + "\" y2=\"" + number(y2) + "\" " + more + "/>\n";
}

std::vector<Placed> rows_of(const Shot& shot) {
  std::vector<Placed> rows;
  int y = kTop;
  for (const Stage stage : stages_of(shot)) {
    for (const base::PassRow& pass : plan_of(shot, stage).passes) rows.push_back({std::string(stage_name(stage)), pass, y}), y += kRow;
    y += kRow / 2;
  }
  return rows;
}

struct Datum {
  int column = 0, from = 0, to = 0;
};

// A column is used again below where its datum ends, so that the picture stays narrow.
std::map<std::string_view, Datum> data_of(const std::vector<Placed>& rows) {
  std::map<std::string_view, Datum> data;
  std::vector<std::string_view> order;
  for (const Placed& row : rows)
    for (const auto& names : {row.pass.reads, row.pass.writes})
      for (const std::string_view name : names) {
        if (!data.contains(name)) order.push_back(name), data[name] = {0, row.y, row.y};
        data[name].to = row.y;
      }
  std::vector<int> free_from;
  for (const std::string_view name : order) {
    Datum& d = data[name];
    const auto column = std::find_if(free_from.begin(), free_from.end(), [&](int y) { return y < d.from - kRow; });
    d.column = int(column - free_from.begin());
    if (column == free_from.end()) free_from.push_back(d.to);
    else *column = d.to;
  }
  return data;
}

std::string box(const Placed& row) {
  const bool step = row.pass.often == base::PassRow::Often::step;
  return "<rect x=\"" + number(kLeft) + "\" y=\"" + number(row.y - 12) + "\" width=\"" + number(kBox) + "\" height=\"24\" rx=\"5\" fill=\"" +
         (step ? "#2f6f9f" : "#7a7f87") + "\"/>\n" +
         text(kLeft + kBox / 2, row.y + 4, std::string(row.pass.name), "fill=\"#ffffff\" text-anchor=\"middle\"");
}

std::string ends(const Placed& row, const std::map<std::string_view, Datum>& data) {
  std::string out;
  const auto x_of = [&](std::string_view name) { return kFirstLine + data.at(name).column * kColumn; };
  for (const std::string_view name : row.pass.reads)
    out += line(kLeft + kBox, row.y - 4, x_of(name), row.y - 4, "stroke=\"#9aa0a8\"") + "<circle cx=\"" + number(x_of(name)) + "\" cy=\"" +
           number(row.y - 4) + "\" r=\"4\" fill=\"#ffffff\" stroke=\"#5a6068\"/>\n";
  for (const std::string_view name : row.pass.writes)
    out += line(kLeft + kBox, row.y + 5, x_of(name), row.y + 5, "stroke=\"#c0603a\"") + "<circle cx=\"" + number(x_of(name)) + "\" cy=\"" +
           number(row.y + 5) + "\" r=\"4\" fill=\"#c0603a\"/>\n";
  return out;
}

}  // namespace

std::string pass_graph(const Shot& shot) {
  const std::vector<Placed> rows = rows_of(shot);
  const auto data = data_of(rows);
  int columns = 0;
  for (const auto& [name, d] : data) columns = std::max(columns, d.column + 1);
  const int width = kFirstLine + columns * kColumn + kMargin, height = rows.back().y + kRow + 20;
  std::string out = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + number(width) + "\" height=\"" + number(height) + "\" viewBox=\"0 0 " +
                    number(width) + " " + number(height) +
                    "\" font-family=\"sans-serif\" font-size=\"13\">\n<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n";
  out += text(kMargin, 28, "Passes of " + shot.name, "font-size=\"16\" fill=\"#202428\"");
  out += text(kMargin, 46, "blue: every step, grey: every frame; open circle: read, full circle: written", "font-size=\"11\" fill=\"#5a6068\"");
  for (const auto& [name, d] : data) {
    const int x = kFirstLine + d.column * kColumn;
    out += line(x, d.from - 8, x, d.to + 8, "stroke=\"#5a6068\" stroke-width=\"2\"");
  }
  std::string stage;
  for (const Placed& row : rows) {
    if (row.stage != stage) out += text(kMargin, row.y + 4, row.stage, "fill=\"#202428\" font-weight=\"bold\"");
    stage = row.stage;
    out += ends(row, data) + box(row);
  }
  for (const auto& [name, d] : data)
    out += text(kFirstLine + d.column * kColumn, d.from - 12, std::string(name),
                "font-size=\"11\" text-anchor=\"middle\" fill=\"#202428\" stroke=\"#ffffff\" stroke-width=\"3\" paint-order=\"stroke\"");
  return out + "</svg>\n";
}

}  // namespace app
