// Names of ports that were probably meant to be the same. docs/checking.md has the rule in words.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

namespace arbiter::rules {

enum class Resemblance {
  kNone,   // two names; also siblings, such as /Nav1/vel:o and /Nav2/vel:o
  kSlip,   // a slip of the pen apart, and as likely two names as one misspelt; also those of
           // which one is the other without a namespace
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
//
// Where thousands of long names have one pattern, all of them are near enough to each other to be
// compared, letter by letter. So there is a bound on that, which no model that somebody has written
// comes near to; is_exhausted() says that it was met, and that something may have been passed over.
class NameIndex {
 public:
  static constexpr std::size_t kMaxComparedBytes = 100'000'000;

  explicit NameIndex(std::vector<std::string_view> names,
                     std::size_t max_compared_bytes = kMaxComparedBytes);

  // Those that resemble it, without itself, in the order in which they were given.
  [[nodiscard]] std::vector<SimilarName> similar_to(std::string_view name);

  [[nodiscard]] bool is_exhausted() const { return bytes_left_ == 0; }

 private:
  using Words = std::vector<NameWord>;
  // Names are found by hashes of what they have in common, and then looked at.
  struct Entry {
    std::uint64_t hash;
    std::uint32_t name;
    std::uint32_t word;  // the one that is left open
  };
  using Entries = std::vector<Entry>;  // by hash

  void look_for_slips(std::string_view name, std::map<std::size_t, Resemblance>& found);
  // The words, of which one is left open, with what differs from them there at most.
  void compare(const Words& words, std::size_t open, std::span<const Entry> entries,
               std::map<std::size_t, Resemblance>& found);
  void look_for_namespaces(std::string_view name, std::map<std::size_t, Resemblance>& found);
  [[nodiscard]] const std::string& letters_of(const Entry& entry) const;
  bool spend(std::size_t bytes);

  const std::vector<std::string_view> names_;
  std::vector<Words> words_;                        // by name
  std::vector<std::vector<std::string>> segments_;  // by name
  std::unordered_map<std::string, std::vector<std::size_t>> by_plain_;
  Entries by_pattern_;    // by the name with that word left open, then by the word's letters
  Entries by_segments_;   // by the whole name
  Entries by_shortened_;  // by the name without a namespace; `word` is of no interest
  std::size_t bytes_left_;
};

}  // namespace arbiter::rules
