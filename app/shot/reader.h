#pragma once
// A visitor that fills declared parameters from a tree and says what is wrong with the tree.
#include <set>
#include <string>
#include <vector>

#include "app/shot/tree.h"
#include "base/params.h"

namespace app {

class Reader : public base::Params {
 public:
  /// `file` is what errors without a place of their own call the shot. `root` must outlive the reader.
  Reader(const Node& root, std::string file);

  /// Complains about the keys that nobody declared; call when every parameter has been visited.
  void finish();
  /// Throws what is wrong with the shot: the first bad key or value in the order of the file, else the first
  /// key that has no effect, else the first law that does not hold: both may come of a misspelt key that left its default.
  void throw_if_wrong() const;
  /// The same, leaving out laws and every value that was not written in `under` ("quality.draft.").
  void throw_if_wrong_under(const std::string& under) const;

  /// What the shot sets, in the order and spelling of the declarations.
  const Node& given() const { return given_; }
  /// The same with every default written out; an optional that is unset is absent.
  const Node& complete() const { return complete_; }

  void count_or_name(const base::Key&, base::CountOrName&) override;
  bool table(std::string_view name, std::string_view meaning, const std::function<void(base::Params&)>& keys) override;
  void preset_or_table(std::string_view name, std::string& preset, std::span<const std::string_view> names, std::string_view meaning,
                       const std::function<void(base::Params&)>& keys) override;
  void where(bool condition, std::string_view needs, const std::function<void()>& keys) override;
  void without(std::string_view table, std::string_view reason) override;
  void require(bool holds, std::string_view key, const std::string& message) override;

 protected:
  void number(const base::Key&, double&) override;
  void integer(const base::Key&, std::int64_t&) override;
  void flag(const base::Key&, bool&) override;
  void text(const base::Key&, std::string&) override;
  void vector(const base::Key&, base::Vec3&) override;
  void box(const base::Key&, base::Box&) override;
  void optional_number(const base::Key&, std::optional<double>&) override;
  void optional_vector(const base::Key&, std::optional<base::Vec3>&) override;
  void optional_box(const base::Key&, std::optional<base::Box>&) override;
  void list_of(std::string_view name, std::string_view meaning, const std::function<void(std::size_t)>& resize,
               const std::function<void(std::size_t, base::Params&)>& entry) override;
  void map_of(std::string_view name, std::string_view meaning, const std::function<void(const std::string&, base::Params&)>& entry) override;

 private:
  /// The table that is being read.
  struct Scope {
    const Node* node;                   // empty table when the shot does not have it
    std::string path;                   // "body.column."
    std::vector<std::string> declared;  // names asked for so far
    std::set<std::string> unmet;        // what other names of it need
    Node given, complete;
  };
  struct Wrong {
    enum class What { value, dependent, law } what = What::value;   // a key that another one makes useless is told after what that one may have wrong
    std::string under;
    base::Complaint complaint;
  };

  Scope& scope() { return scopes_.back(); }
  const Node* declare(std::string_view name);
  void open(const Node& node, const std::string& path);
  Scope close();
  void complain_unknown(const Scope&);
  /// "KEY = VALUE UNIT: must be ALLOWED (HINT)" at the place of `value`.
  void complain(const base::Key&, const Node& value, const std::string& allowed, const std::string& hint = {});
  /// False, and a complaint about `whole`, when `part` of it is not what `kind` says or out of range.
  bool read_number(const base::Key&, const Node& whole, const Node& part, const std::string& kind, double&);
  bool read_vector(const base::Key&, const Node& whole, const Node& part, const std::string& kind, base::Vec3&);
  bool read_box(const base::Key&, const Node&, base::Box&);
  void check_names(const Node& list, std::string_view name);
  /// Notes a value that was visited, for given() and complete().
  void note(std::string_view name, const Node* written, Node value);

  std::string file_;
  Node nothing_;
  std::vector<Scope> scopes_;
  std::vector<Wrong> wrong_;
  Node given_, complete_;
};

/// `"a", "b" or "c"`.
std::string one_of(std::span<const std::string_view> names);

/// The first `size` numbers of `v` as a node, in the spelling of the canonical text.
Node vector_node(const base::Vec3& v, std::int64_t size = 3);
Node box_node(const base::Box& v, std::int64_t size = 3);

}  // namespace app
