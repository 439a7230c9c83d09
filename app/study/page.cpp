#include "app/study/page.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>

#include "app/study/page_style.h"
#include "app/study/pictures.h"
#include "app/study/text.h"
#include "base/atomic_file.h"
#include "base/error.h"

namespace app {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kSheetWidth = 384, kStripWidth = 640;   // [pixels] of a picture, at most

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size()) text.replace(at, from.size(), to);
  return text;
}

std::string without(std::string text, const std::string& tag) {
  const std::string open = "<" + tag + ">", close = "</" + tag + ">";
  for (std::size_t at; (at = text.find(open)) != std::string::npos;) {
    const std::size_t end = text.find(close, at);
    if (end == std::string::npos) break;
    text.erase(at, end + close.size() - at);
  }
  return text;
}

/// The <svg> element with names of its own: a page holds several, and gnuplot gives all the same.
std::string svg_element(const std::string& svg, int number) {
  const std::size_t begin = svg.find("<svg"), end = svg.rfind("</svg>");
  if (begin == std::string::npos || end == std::string::npos) throw std::invalid_argument("a figure is no SVG");
  std::string element = svg.substr(begin, end + 6 - begin);
  if (element.find("<script") != std::string::npos) throw std::invalid_argument("a figure holds a script");
  const std::string own = "p" + std::to_string(number) + "_";
  for (const char* before : {"id=\"", "id='", "href=\"#", "href='#", "url(#"}) element = replaced(element, before, std::string(before) + own);
  element = without(without(std::move(element), "title"), "desc");   // tooltips that name gnuplot and its data
  return element;
}

}  // namespace

Cell::Cell(double v) : value(v) {
  if (!std::isfinite(v)) throw std::invalid_argument("a number of a table is not finite");
  char digits[32];
  std::snprintf(digits, sizeof digits, std::abs(v) >= 1000 && std::abs(v) < 1e7 ? "%.0f" : "%.3g", v);
  text = digits;
}

Page::Page(std::string title) : title_(std::move(title)) {}

void Page::subtitle(const std::string& text) { add("<p class=\"subtitle\">" + html_text(text) + "</p>\n"); }

void Page::lead(const std::vector<std::string>& sentences) {
  std::string html = "<div class=\"lead\">\n";
  for (const std::string& sentence : sentences) html += "<p>" + html_text(sentence) + "</p>\n";
  add(html + "</div>\n");
}

void Page::lead(const std::string& name, const std::vector<std::string>& sentences) {
  std::string html = "<div class=\"lead\"><p><strong>" + html_text(name) + "</strong>";
  for (const std::string& sentence : sentences) html += " " + html_text(sentence);
  add(html + "</p></div>\n");
}

void Page::heading(const std::string& text) { add("<h2>" + html_text(text) + "</h2>\n"); }

void Page::paragraph(const std::string& text) { add("<p>" + html_text(text) + "</p>\n"); }

void Page::facts(const std::vector<std::pair<std::string, std::string>>& all) {
  std::string html = "<dl>\n";
  for (const auto& [name, value] : all) html += "<dt>" + html_text(name) + "</dt><dd>" + html_text(value) + "</dd>\n";
  add(html + "</dl>\n");
}

void Page::table(const std::vector<std::string>& columns, const std::vector<std::vector<Cell>>& rows, const std::string& caption) {
  for (const auto& row : rows)
    if (row.size() != columns.size()) throw std::invalid_argument("a row of a table has not one cell a column");
  const auto is_number = [&](std::size_t column) {
    return std::any_of(rows.begin(), rows.end(), [&](const auto& row) { return row[column].value.has_value(); });
  };
  std::string html = "<div class=\"wide\"><table id=\"table" + std::to_string(++tables_) + "\">\n";
  if (!caption.empty()) html += "<caption>" + html_text(caption) + "</caption>\n";
  html += "<thead><tr>";
  for (std::size_t c = 0; c < columns.size(); ++c)
    html += std::string("<th scope=\"col\" aria-sort=\"none\"") + (is_number(c) ? " class=\"number\"" : "") + "><button type=\"button\">"
        + html_text(columns[c]) + "</button></th>";
  html += "</tr></thead>\n<tbody>\n";
  for (const auto& row : rows) {
    html += "<tr>";
    for (std::size_t c = 0; c < row.size(); ++c) {
      const Cell& cell = row[c];
      char value[64] = "";
      if (cell.value) std::snprintf(value, sizeof value, " data-value=\"%.17g\"", *cell.value);
      std::string kinds;
      for (const auto& [holds, kind] : {std::pair{is_number(c), "number"}, {cell.strong, "strong"}, {cell.is_name, "name"}})
        if (holds) kinds += (kinds.empty() ? "" : " ") + std::string(kind);
      html += std::string("<td") + (kinds.empty() ? "" : " class=\"" + kinds + "\"") + value + ">" + html_text(cell.text) + "</td>";
    }
    html += "</tr>\n";
  }
  add(html + "</tbody></table></div>\n");
}

void Page::figure_of(const std::string& svg, const std::string& caption) {
  const std::string element = svg_element(svg, ++figures_);
  add("<figure>" + element + (caption.empty() ? "" : "<figcaption>" + html_text(caption) + "</figcaption>") + "</figure>\n");
}

void Page::figures_of(const std::vector<std::string>& svgs) {
  add("<div class=\"pair\">\n");
  for (const std::string& svg : svgs) figure_of(svg);
  add("</div>\n");
}

void Page::figure(const fs::path& svg_file, const std::string& caption) { figure_of(base::read_file(svg_file), caption); }

void Page::add_picture(const fs::path& file, std::int64_t width, const std::string& attributes, const std::string& label) {
  add("<img " + attributes + "alt=\"" + html_text(label) + "\" src=\"");
  pieces_.push_back({{}, file, width});
  add("\">");
}

void Page::scrubber(const std::vector<Strip>& strips, const std::vector<std::string>& moments) {
  const std::string id = "scrubber" + std::to_string(++scrubbers_);
  add("<div class=\"scrubber\" id=\"" + id + "\">\n<div class=\"strips\">\n");
  for (const Strip& strip : strips) {
    add("<figure class=\"strip\"><div class=\"frames\">");
    for (std::size_t k = 0; k < moments.size(); ++k) {
      const std::string attributes =
          "data-frame=\"" + std::to_string(k) + "\" " + (k + 1 == moments.size() ? "" : "hidden ");   // opens where most has happened
      if (k < strip.pictures.size()) add_picture(strip.pictures[k], kStripWidth, attributes, strip.label + ", " + moments[k]);
      else add("<span class=\"none\" " + attributes + ">no picture</span>");
    }
    add("</div><figcaption>" + html_text(strip.label) + "</figcaption></figure>\n");
  }
  std::string last = std::to_string(moments.empty() ? 0 : moments.size() - 1), html =
      "</div>\n<div class=\"controls\"><button type=\"button\" class=\"play\" aria-label=\"play\">&#9654;</button>";
  html += "<input type=\"range\" min=\"0\" max=\"" + last + "\" value=\"" + last + "\" step=\"1\" aria-label=\"frame\"><output>"
      + (moments.empty() ? "" : html_text(moments.back())) + "</output></div>\n<ol hidden>";
  for (const std::string& moment : moments) html += "<li>" + html_text(moment) + "</li>";
  add(html + "</ol></div>\n");
}

void Page::contact_sheet(const std::vector<fs::path>& pictures, const std::vector<std::string>& labels) {
  add("<div class=\"sheet\">\n");
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    const std::string label = i < labels.size() ? labels[i] : "";
    add("<figure>");
    add_picture(pictures[i], kSheetWidth, "", label);
    add("<figcaption>" + html_text(label) + "</figcaption></figure>\n");
  }
  add("</div>\n");
}

void Page::details(const std::string& summary, const std::string& text) {
  add("<details><summary>" + html_text(summary) + "</summary><pre>" + html_text(text) + "</pre></details>\n");
}

std::string Page::text() const {
  std::vector<PictureRequest> wanted;
  std::size_t bytes = kPageHead.size() + kPageStyle.size() + kPageScript.size() + title_.size() * 12 + 1000;
  for (const Piece& piece : pieces_) {
    bytes += piece.html.size();
    if (!piece.picture.empty()) wanted.push_back({piece.picture, piece.width});
  }
  const std::vector<std::string> pictures = data_urls(wanted, kLargestPage - std::min(kLargestPage, bytes));
  const std::string title = html_text(title_);
  std::string html = std::string(kPageHead) + "<title>" + title + "</title>\n<style>\n" + std::string(kPageStyle)
      + "</style>\n</head>\n<body>\n<main>\n<h1>" + title + "</h1>\n";
  std::size_t next = 0;
  for (const Piece& piece : pieces_) html += piece.picture.empty() ? piece.html : pictures[next++];
  html += "</main>\n<script>\n" + std::string(kPageScript) + "</script>\n</body>\n</html>\n";
  if (html.size() > kLargestPage) throw base::Error({.code = base::Exit::fault, .message = "the page '" + title_ + "' has "
      + std::to_string(html.size()) + " bytes"});
  return html;
}

void Page::write(const fs::path& path) const { base::write_text_atomically(path, text()); }

}  // namespace app
