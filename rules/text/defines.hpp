// The defines of a model: names for pieces of text, used as ${name} (paper, listing 1).
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "rules/text/diagnostic.hpp"
#include "rules/text/text.hpp"

namespace arbiter::rules {

// Of one text with its defines expanded, and of all such texts of a model. Without a bound, a few
// lines of defines that use each other would make gigabytes.
inline constexpr std::size_t kMaxExpandedBytes = 64u << 10;
inline constexpr std::size_t kMaxExpandedBytesInAll = 64u << 20;

class Defines {
 public:
  // False where the name is taken; then the first define stands. A define without a value is one
  // that could not be read: it keeps its uses from being reported as well. `is_offered`: nobody
  // need use it.
  bool add(const std::string& name, std::optional<std::string> value, const Location& where,
           bool is_offered = false);
  [[nodiscard]] const Location* find(const std::string& name) const;

  // Tells of a define further down in the file that is being read, so that a use before it is
  // explained.
  void announce(const std::string& name, const Location& where);
  // Files of the model that are read after this one, by path and content: a define that is found
  // there is told. Keeps views.
  using LaterFiles = std::vector<std::pair<std::string_view, std::string_view>>;
  void expect_later(LaterFiles files) { later_ = std::move(files); }
  // From here on unknown names are not reported: some file could not be read, and with it perhaps
  // their defines.
  void expect_gaps() { expects_gaps_ = true; }

  // Empty where something is wrong, which was then reported.
  std::optional<Text> expand(const Text& text, Diagnostics& diagnostics);

  // Whether what is wrong with the whole of its text is told for the first time: that is told at
  // one of its uses. Of a name that is none, false.
  bool tells_fault_of(const std::string& name);

  // Notes "unused-define". To be asked behind the last text: no text may have been refused, since
  // it may have had the use.
  void note_unused(Diagnostics& diagnostics) const;

 private:
  struct Define {
    std::optional<std::string> value;
    Location where;
    bool is_used = false;  // or need not be
    bool is_faulty = false;
  };
  // The define that a use names, or nothing, reported.
  const std::string* look_up(const std::string& name, const Text& text, std::size_t at,
                             Diagnostics& diagnostics);
  // The later file that defines it; empty: none does, as far as a look without XML can tell.
  [[nodiscard]] std::string_view later_file_with(std::string_view name) const;
  bool take_account_of(std::size_t bytes, const Text& text, std::size_t at,
                       Diagnostics& diagnostics);

  std::map<std::string, Define> defines_;
  std::map<std::string, Location> announced_;
  LaterFiles later_;
  std::size_t expanded_in_all_ = 0;
  bool expects_gaps_ = false;
};

}  // namespace arbiter::rules
