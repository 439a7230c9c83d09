#pragma once
// A page that holds all it shows: one HTML file without anything from outside, to be mailed, opened from a disk or put into a talk.
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace app {

/// Of a table. Numbers are shown as given in `text` and sorted by `value`.
struct Cell {
  std::string text;
  std::optional<double> value;   // none: sorted as text, and after all numbers
  bool strong = false;
  bool is_name = false;          // stands on one line
  Cell() = default;
  Cell(const char* t) : text(t) {}
  Cell(std::string t) : text(std::move(t)) {}
  Cell(double v);                // three significant digits: "0.0123", "1.5e-07"
  Cell(std::string t, double v) : text(std::move(t)), value(v) {}
};

/// Pictures of one film or variant, in order.
struct Strip {
  std::string label = {};
  std::vector<std::filesystem::path> pictures = {};   // PNG; of each frame one
};

class Page {
 public:
  explicit Page(std::string title);

  /// A line below the title, and sentences set apart on top.
  void subtitle(const std::string&);
  void lead(const std::vector<std::string>& sentences);
  /// The same as one paragraph that begins with a name.
  void lead(const std::string& name, const std::vector<std::string>& sentences);
  void heading(const std::string&);
  void paragraph(const std::string&);
  /// Names and values, one a line.
  void facts(const std::vector<std::pair<std::string, std::string>>&);
  /// A click on a column's head sorts by it, another one the other way round. Throws std::invalid_argument when a row has not one cell a column.
  void table(const std::vector<std::string>& columns, const std::vector<std::vector<Cell>>& rows, const std::string& caption = "");
  /// The text of an SVG, or a file with one. Throws base::Error (exit 2) for a file that cannot be read, std::invalid_argument for an SVG with a
  /// script.
  void figure_of(const std::string& svg, const std::string& caption = "");
  void figure(const std::filesystem::path& svg_file, const std::string& caption = "");
  /// Several, two beside each other where there is room.
  void figures_of(const std::vector<std::string>& svgs);
  /// Strips side by side with one slider; the k-th picture of each is shown over `moments`[k] ("frame 3, t = 0.083 s"). Pictures that cannot be
  /// read are left out with a word in their place. A strip may be shorter than `moments`.
  void scrubber(const std::vector<Strip>&, const std::vector<std::string>& moments);
  /// All pictures at once, each over its label.
  void contact_sheet(const std::vector<std::filesystem::path>& pictures, const std::vector<std::string>& labels);
  /// Text as it stands, folded away below `summary`.
  void details(const std::string& summary, const std::string& text);

  /// The file; pictures are made as large as kLargestPage allows.
  std::string text() const;
  /// Atomically; throws base::Error (exit 5).
  void write(const std::filesystem::path&) const;

  static constexpr std::size_t kLargestPage = 20 * 1000 * 1000;   // [bytes]

 private:
  /// A piece of the page: HTML, or a picture that stands between its neighbours.
  struct Piece {
    std::string html;
    std::filesystem::path picture;
    std::int64_t width = 0;   // [pixels] at most
  };
  void add(std::string html) { pieces_.push_back({std::move(html), {}, 0}); }
  void add_picture(const std::filesystem::path&, std::int64_t width, const std::string& attributes, const std::string& label);

  std::string title_;
  std::vector<Piece> pieces_;
  int figures_ = 0, tables_ = 0, scrubbers_ = 0;
};

}  // namespace app
