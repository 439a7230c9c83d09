#include "app/study/cost_report.h"

#include <algorithm>
#include <cstdio>
#include <map>

#include "app/stages/folder.h"
#include "app/study/cost_plots.h"
#include "app/study/page.h"
#include "base/error.h"
#include "base/text.h"

namespace app {
namespace {

namespace fs = std::filesystem;

std::string number(const char* form, double value) {
  char text[64];
  std::snprintf(text, sizeof text, form, value);
  return text;
}

/// Letters and digits of a name, the rest as '_'.
std::string file_name(const std::string& name) {
  std::string out;
  for (const char c : name) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
    if (plain) out += c;
    else if (!out.empty() && out.back() != '_') out += '_';
  }
  while (!out.empty() && out.back() == '_') out.pop_back();
  return out;
}

/// The plots of a case under the names of their files: one that all else depends on, and pairs.
struct CasePlots {
  std::vector<std::string> names;
  std::vector<Plot> plots;
  std::size_t wide = 0;   // the first ones stand alone
};

CasePlots plots_of(const Study& study, const StudyCase& part) {
  CasePlots all;
  const std::string tail = study.cases.size() > 1 ? "." + file_name(part.name) : "";
  const auto add = [&](const std::string& name, std::optional<Plot> plot, bool half) {
    if (!plot) return;
    if (half && plot->categories.empty()) {
      constexpr int kRow = 24, kFewRows = 3;   // [pixels] of a legend with two names a row
      const int rows = int(plot->series.size() + 1) / 2;
      plot->width = 640, plot->height = plot->labels.empty() ? 460 + kRow * std::max(0, rows - kFewRows) : 520;   // labels need room
    }
    all.names.push_back(name + tail);
    all.plots.push_back(std::move(*plot));
    if (!half) ++all.wide;
  };
  const auto name = [](Measure m) { return "error_" + std::string(kMeasureNames[static_cast<std::size_t>(m)]); };
  add(name(part.decides), error_plot(study, part, part.decides), false);
  for (std::size_t m = 0; m < kMeasureNames.size(); ++m)
    if (static_cast<Measure>(m) != part.decides) add(name(static_cast<Measure>(m)), error_plot(study, part, static_cast<Measure>(m)), true);
  add("energy", energy_plot(study, part), true);
  add("enstrophy", enstrophy_plot(study, part), true);
  add("seconds", seconds_plot(study, part), true);
  add("losses", losses_plot(study, part), true);
  return all;
}

/// Median and half the spread, where there is one.
Cell seconds_cell(const Variant& v) {
  if (v.seconds.size() == 1) return {number("%.3g", v.seconds_median), v.seconds_median};
  return {number("%.3g", v.seconds_median) + " ± " + number("%.2g", (v.seconds_max - v.seconds_min) / 2), v.seconds_median};
}

/// Numbers of variants within their cases, from 1: names are long.
std::map<const Variant*, std::size_t> numbered(const Study& study) {
  std::map<std::string, std::size_t> counts;
  std::map<const Variant*, std::size_t> numbers;
  for (const Variant& v : study.variants) numbers[&v] = ++counts[v.part];
  return numbers;
}

std::string ties_of(const Study& study, const Variant& variant, const std::map<const Variant*, std::size_t>& numbers) {
  std::string text;
  for (const Variant& other : study.variants)
    if (other.part == variant.part && std::find(variant.ties.begin(), variant.ties.end(), other.label) != variant.ties.end())
      text += (text.empty() ? "" : ", ") + std::to_string(numbers.at(&other));
  return text;
}

/// All variants; columns that no variant fills are left out.
void add_table(Page& page, const Study& study) {
  std::vector<std::string> columns;
  if (study.cases.size() > 1) columns.push_back("case");
  columns.insert(columns.end(), {"#", "variant", "seconds [s]", "CPU seconds [s]"});
  std::vector<Measure> measures;
  for (std::size_t m = 0; m < kMeasureNames.size(); ++m)
    if (std::any_of(study.variants.begin(), study.variants.end(), [&](const Variant& v) { return v.errors.value[m].has_value(); })) {
      measures.push_back(static_cast<Measure>(m));
      columns.push_back("error of " + std::string(kMeasureNames[m]));
    }
  columns.insert(columns.end(), {"memory [MB]", "front", "ties"});
  const auto numbers = numbered(study);
  std::vector<std::vector<Cell>> rows;
  for (const Variant& v : study.variants) {
    std::vector<Cell> row;
    if (study.cases.size() > 1) row.emplace_back(v.part);
    row.emplace_back(static_cast<double>(numbers.at(&v)));
    row.emplace_back(v.label);
    row.back().strong = v.pareto, row.back().is_name = true;
    if (v.ran()) {
      row.push_back(seconds_cell(v));
      row.emplace_back(number("%.3g", v.cpu_seconds), v.cpu_seconds);
      for (const Measure m : measures) row.push_back(v.errors[m] ? Cell(*v.errors[m]) : Cell());
      row.emplace_back(number("%.0f", static_cast<double>(v.peak_bytes) / 1e6), static_cast<double>(v.peak_bytes));
      row.emplace_back(v.pareto ? "yes" : "");
      row.emplace_back(ties_of(study, v, numbers));
    } else {
      row.emplace_back("could not run");
      row.resize(columns.size());
    }
    rows.push_back(std::move(row));
  }
  page.table(columns, rows,
             std::string("A click on a head sorts. ") +
                 (study.repeats > 1 ? "Seconds are medians and half the spread. " : "Seconds are of one run. ") +
                 "On the front (bold): nothing that was tried is both nearer to the truth and faster. Ties: those of the same case that are as "
                 "fast, within the spread.");
}

/// Seconds to errors, the least of each in bold.
void add_times(Page& page, const StudyCase& part) {
  const TimeToError& times = part.times;
  if (times.levels.empty()) return;
  std::vector<std::string> columns{"scheme"};
  for (const double level : times.levels) columns.push_back(number("%g", level));
  std::vector<std::vector<Cell>> rows;
  for (const TimeToError::Row& row : times.rows) {
    rows.push_back({Cell(row.scheme)});
    rows.back().back().is_name = true;
    for (std::size_t l = 0; l < times.levels.size(); ++l) {
      const auto& reach = row.reaches[l];
      if (!reach) {
        rows.back().emplace_back();
        continue;
      }
      rows.back().emplace_back((reach->at_most ? "≤ " : "") + number("%.3g", reach->seconds), reach->seconds);
      rows.back().back().strong = std::none_of(times.rows.begin(), times.rows.end(), [&](const TimeToError::Row& other) {
        return &other != &row && other.reaches[l] && (other.reaches[l]->at_most || other.reaches[l]->seconds < reach->seconds);
      });
    }
  }
  const std::string error(kMeasureNames[static_cast<std::size_t>(part.decides)]);
  page.table(columns, rows, "Seconds to an error of " + error + ". Between two variants of a scheme seconds are a power of the error. ≤: the fastest that was tried has less error; empty: nothing that was tried comes to it.");
}

/// "polypic full linear, cell 0.02 m"
std::string scheme_text(const Variant& v) {
  std::string text = v.transfer;
  for (const std::string& word : {v.modes, v.kernel, v.splitting == "reflection" ? v.splitting : std::string()})
    if (!word.empty()) text += " " + word;
  return text + ", cell " + number("%.3g", v.cell) + " m";
}

void add_frames(Page& page, const Study& study) {
  std::vector<Strip> strips;
  std::vector<std::int64_t> frames;
  const auto add = [&](const Variant& v, const std::string& label) {
    if (v.pictures.empty()) return;
    strips.push_back({label, {}});
    for (const Picture& picture : v.pictures) strips.back().pictures.push_back(picture.file);
    if (v.pictures.size() <= frames.size()) return;
    frames.clear();
    for (const Picture& picture : v.pictures) frames.push_back(picture.frame);
  };
  if (study.reference) add(*study.reference, "reference: " + scheme_text(*study.reference));
  for (const Variant& v : study.variants) add(v, study.cases.size() > 1 ? v.part + ": " + v.label : v.label);
  if (strips.empty()) return;
  std::vector<std::string> moments;
  for (const std::int64_t frame : frames) moments.push_back("frame " + std::to_string(frame));
  page.heading("Frames side by side");
  page.scrubber(strips, moments);
}

void add_plots(Page& page, const Study& study, const fs::path& out, base::Progress& progress) {
  std::vector<CasePlots> all;
  std::vector<Plot> plots;
  std::vector<fs::path> stems;
  for (const StudyCase& part : study.cases) {
    all.push_back(plots_of(study, part));
    plots.insert(plots.end(), all.back().plots.begin(), all.back().plots.end());
    for (const std::string& name : all.back().names) stems.push_back(out / "plots" / name);
  }
  std::vector<std::string> svgs;
  try {
    if (!plots.empty()) Folder::make_room_for(fs::path(stems.front()));
    svgs = write_plots(plots, stems);
  } catch (const base::Error& e) {
    if (!is_without_gnuplot(e)) throw;
    progress.line(std::string("report without plots: ") + e.what());
    page.paragraph(std::string("No plots: ") + e.what());
    for (const StudyCase& part : study.cases) add_times(page, part);
    return;
  }
  std::size_t next = 0;
  for (std::size_t c = 0; c < all.size(); ++c) {
    page.heading(study.cases.size() > 1 ? study.cases[c].name : "Error against seconds");
    for (std::size_t i = 0; i < all[c].wide; ++i) page.figure_of(svgs[next++]);
    add_times(page, study.cases[c]);
    const std::size_t rest = all[c].plots.size() - all[c].wide;
    page.figures_of(std::vector<std::string>(svgs.begin() + static_cast<std::ptrdiff_t>(next),
                                             svgs.begin() + static_cast<std::ptrdiff_t>(next + rest)));
    next += rest;
  }
}

void add_facts(Page& page, const Study& study) {
  page.heading("How it was measured");
  for (const std::string& note : study.notes) page.paragraph(note);
  std::vector<std::pair<std::string, std::string>> facts;
  for (std::size_t m = 0; m < kMeasureNames.size(); ++m)
    if (!study.meaning[m].empty()) facts.push_back({"error of " + std::string(kMeasureNames[m]), study.meaning[m]});
  for (const StudyCase& part : study.cases)
    for (std::size_t m = 0; m < kMeasureNames.size(); ++m)
      if (part.noise.value[m]) facts.push_back({"noise of " + std::string(kMeasureNames[m]) + (study.cases.size() > 1 ? ", " + part.name : ""),
          number("%.3g", *part.noise.value[m])});
  facts.push_back({"command", study.command});
  facts.push_back({"program", "polypic " + study.version + (study.commit.empty() ? "" : " (" + study.commit + ")")});
  const std::string threads = base::count_of(study.threads, "thread");
  facts.push_back({"machine", study.processor + ", " + base::count_of(study.cores, "core")});
  facts.push_back({"measured", study.repeats == 1
                                   ? "each variant once, with " + threads + ": how far times scatter is not known"
                                   : "each variant " + std::to_string(study.repeats) + " times, in turns, after one run to warm up, with " + threads +
                                         "; runs that differ by more than 15 % are made again; the median is shown"});
  page.facts(facts);
  std::string failures;
  std::size_t failed = 0;
  for (const Variant& v : study.variants)
    if (!v.ran()) failures += v.part + ", " + v.label + ": " + v.failure + "\n", ++failed;
  if (failed > 0) page.details(base::count_of(failed, "variant") + " could not run", failures);
}

}  // namespace

void write_cost_report(const Study& study, const fs::path& out, base::Progress& progress) {
  Page page("What accuracy costs: " + study.subject);
  page.subtitle(study.title);
  for (const StudyCase& part : study.cases) {
    const std::vector<std::string> sentences(part.sentences.begin(), part.sentences.end());
    if (study.cases.size() == 1) page.lead(sentences);
    else page.lead(part.name, sentences);
  }
  add_frames(page, study);
  add_plots(page, study, out, progress);
  page.heading("All variants");
  add_table(page, study);
  add_facts(page, study);
  page.write(out / "report.html");
}

}  // namespace app
