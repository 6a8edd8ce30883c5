// Names of ports that were probably meant to be the same. docs/checking.md has the rule in words.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

namespace arbiter::rules {

enum class Resemblance {
  kNone,   // two names; also siblings, such as /Nav1/vel:o and /Nav2/vel:o
  kSlip,   // a slip of the pen apart, and as likely two names as one misspelt
  kClose,  // a slip apart that hardly ever makes another name
};

struct SimilarName {
  std::string_view name;
  Resemblance how;
};

// A word of a name, with what is asked of it time and again.
struct NameWord {
  explicit NameWord(std::string word);
  std::string text;
  std::string letters;           // without its digits
  std::uint64_t characters = 0;  // that it has, as bits; a slip changes two of them at most
};

// Names arranged so that each is compared with few others. Keeps views of them.
class NameIndex {
 public:
  explicit NameIndex(std::vector<std::string_view> names);

  // Those that resemble it, without itself, in the order in which they were given.
  [[nodiscard]] std::vector<SimilarName> similar_to(std::string_view name) const;

 private:
  std::vector<std::string_view> names_;
  std::unordered_map<std::string, std::vector<std::size_t>> by_plain_;
  // By a name with one of its words left open: that word, and whose it is.
  std::unordered_map<std::string, std::vector<std::pair<NameWord, std::size_t>>> by_key_;
};

}  // namespace arbiter::rules
