// Which names of ports the files of a model have, and where: what the search for misspelt names
// (rules/model/name_checks.hpp) goes by.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>

#include "rules/text/diagnostic.hpp"

namespace arbiter::rules {

// A name that is used somewhere.
struct Mention {
  std::string name;
  Location where;
  std::string define{};  // that the whole name came out of, if it did
};

// What the files say of a name, as bits.
enum NameRole : std::uint8_t {
  kDeclared = 1,   // <source port="…"/>, or an <arbiter at="…"/> without rules
  kConnected = 2,  // by a <config>, a <select>, or the application
  kRead = 4,       // by a condition
};

struct NameUse {
  Location where;            // the first place
  std::string define;        // that it came out of there
  bool is_repeated = false;  // it is written in another place, too
  std::uint8_t roles = 0;
};

class NameUses {
 public:
  // A define is one place, however often it is used. A file that is full of names costs memory for
  // each name, and not for each place.
  void add(const Mention& mention, NameRole role) {
    const auto [found, is_new] =
        uses_.try_emplace(mention.name, NameUse{mention.where, mention.define, false, 0});
    NameUse& use = found->second;
    use.roles |= role;
    if (!is_new && (mention.define.empty() || mention.define != use.define)) use.is_repeated = true;
  }

  [[nodiscard]] const NameUse* find(const std::string& name) const {
    const auto found = uses_.find(name);
    return found == uses_.end() ? nullptr : &found->second;
  }
  [[nodiscard]] auto begin() const { return uses_.begin(); }
  [[nodiscard]] auto end() const { return uses_.end(); }

 private:
  std::map<std::string, NameUse> uses_;
};

}  // namespace arbiter::rules
