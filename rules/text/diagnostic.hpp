// What reading and checking a model finds, each with its place in a file.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace arbiter::rules {

struct Location {
  std::string file;
  std::uint32_t line = 1;    // from 1
  std::uint32_t column = 1;  // from 1, in bytes

  friend bool operator==(const Location&, const Location&) = default;
};

// file:line:column, to point at a second place from within a message. A file's name with a quote or
// a semicolon in it stands in quotes.
std::string describe(const Location& where);

// The same, as a finding begins with it: without quotes, and fit for a terminal.
std::string printable_place(const Location& where);

enum class Severity { kError, kWarning, kNote };

// An activation of sources that shows a finding: these are active, these are not, the others do not
// matter. Names in byte order.
struct Witness {
  std::vector<std::string> active;
  std::vector<std::string> inactive;
  bool is_shortest = false;  // known to be: no conjunction of fewer literals does the same
};

// "/a and /b active and /c inactive"; "nothing active" if there are no literals.
std::string in_words(const Witness& witness);

// What a finding is about, for programs, which should not have to take its message apart. Empty is
// what it does not speak of.
struct Subject {
  std::vector<std::string> ports{};
  std::string source{};
  std::string behaviour{};  // or meta-behaviour
  std::string statement{};
  // Who wins, or could: port and source, which is none where nobody does.
  std::vector<std::pair<std::string, std::optional<std::string>>> winners{};
};

struct Diagnostic {
  Severity severity = Severity::kError;
  std::string code;  // stable, kebab-case: "both-can-win"
  Location where;
  std::string message;  // what is wrong, and behind the last "; " what to do
  std::optional<Witness> witness;
  std::vector<Witness> more_witnesses;  // of the same, each for itself
  Subject about;
};

// What there is of one code beyond the bound.
struct Omission {
  Severity severity = Severity::kError;
  std::string code;
  Location where;  // of the last one that was kept
  std::size_t count = 0;
};

// What was found, in the order in which it was. Each code has a bound of its own, so that nothing,
// however often it is found, hides anything else; and only errors make an error.
class Diagnostics {
 public:
  // Nobody reads more, and a large file of nothing but mistakes must not fill the memory.
  static constexpr std::size_t kMaxOfCode = 10'000;

  void error(std::string code, Location where, std::string message);
  void error(std::string code, Location where, std::string message, Subject about,
             std::optional<Witness> witness = {});
  void warning(std::string code, Location where, std::string message, Subject about = {});
  void note(std::string code, Location where, std::string message);
  void note(std::string code, Location where, std::string message, Subject about,
            std::optional<Witness> witness = {}, std::vector<Witness> more_witnesses = {});
  // Whether one more of this code is kept. What is only counted needs no message.
  [[nodiscard]] bool keeps_another(Severity severity, const std::string& code) const {
    return count(severity, code) < kMaxOfCode;
  }
  // All that another one has, behind what is here.
  void add(Diagnostics other);
  // Without those of these codes; errors stay.
  void silence(const std::vector<std::string>& codes);
  // Without warnings and notes of this code that are about one of these sources.
  void silence_about(const std::string& code, const std::set<std::string>& sources);
  // Notes are true of many good models. Who asks what there is to say of a model gets them, and
  // nobody who wants it drawn, replayed or compiled.
  void drop_notes();
  void make_warnings_errors();
  template <typename Before>
  void sort_by_place(const Before& is_before) {
    std::stable_sort(items_.begin(), items_.end(), [&](const Diagnostic& a, const Diagnostic& b) {
      return is_before(a.where, b.where);
    });
  }

  [[nodiscard]] bool has_errors() const { return has_errors_; }
  [[nodiscard]] const std::vector<Diagnostic>& items() const { return items_; }
  // Errors first, then warnings, then notes.
  [[nodiscard]] std::vector<Omission> omissions() const;
  // How many were found, kept or not.
  [[nodiscard]] std::size_t count(Severity severity) const;
  [[nodiscard]] std::size_t count(Severity severity, const std::string& code) const;

 private:
  struct Tally {
    std::size_t found = 0;
    Location last_kept;
  };

  // Control characters in the message are made visible.
  void find(Diagnostic item);
  void add(Diagnostic item);

  std::vector<Diagnostic> items_;
  std::map<std::pair<Severity, std::string>, Tally> tallies_;  // of each code, as found
  bool has_errors_ = false;
};

}  // namespace arbiter::rules
