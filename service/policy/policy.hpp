// Who may do what: a file of rules, of which the first that matches decides.
//
// One rule stands on each line:   allow|deny  WHO  ACTION[,ACTION…]  [GLOB…]
//
//   WHO      everyone, owner (the user that the daemon runs as), user NAME, group NAME; numbers
//            serve as names, too
//   ACTION   output, input, deactivate, replay, tap: each on the ports whose names match one of the
//   globs;
//            observe, reload, switch, stop: without globs; all: every action on every port
//
// Behind the last line stand, unwritten: allow user root all; allow owner all; deny everyone all.
// docs/policy.md has the reasons.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "rules/text/diagnostic.hpp"
#include "rules/text/text_file.hpp"

namespace arbiter::service {

enum class Action : std::uint8_t {
  kOutput,
  kInput,
  kDeactivate,
  kObserve,
  kReload,
  kSwitch,
  kStop,
  kReplay,
  kTap
};
inline constexpr std::size_t kActionCount = 9;

// Who asks, as the kernel knows him.
struct Identity {
  uid_t user = 0;
  std::vector<gid_t> groups;  // the primary one and the supplementary ones
};

// Where names become numbers: the accounts of this machine, or a test's.
struct Accounts {
  std::function<std::optional<uid_t>(const std::string& name)> user;
  std::function<std::optional<gid_t>(const std::string& name)> group;
};
Accounts accounts_of_this_machine();

// A line that would allow it to the user of that name or number; empty: no pattern names this port
// alone.
std::string line_that_allows(const std::string& user, Action action, std::string_view port);

// The action of that name that is about no port, such as "observe"; nothing: there is none.
std::optional<Action> action_on_no_port(std::string_view name);

class Policy {
 public:
  struct Verdict {
    bool allowed = false;
    std::string reason;       // names the line that decided
    bool lacks_line = false;  // none of a file's decides, and one could allow it
  };

  // One of those that a line names, as the ports that its actions are about.
  struct Pattern {
    std::string_view glob;
    bool is_on_outputs = false;
    bool is_on_inputs = false;
    const rules::Location* where = nullptr;
  };

  // Bounds of a policy file, so that a question takes microseconds.
  static constexpr std::size_t kMaxRules = 1024;  // a line counts once for each of its globs

  // What holds where no file is given.
  explicit Policy(uid_t owner);
  // Reports all problems in one go; the result is to be used only if there is no error.
  static Policy parse(const rules::TextFile& file, uid_t owner, const Accounts& accounts,
                      rules::Diagnostics& diagnostics);

  // Whether `who` may do it, with the port of that name where the action is about one.
  [[nodiscard]] Verdict may(const Identity& who, Action action, std::string_view port = {}) const;

  [[nodiscard]] std::size_t size() const { return rules_.size(); }
  // From the root; empty: it is the default.
  [[nodiscard]] const std::string& path() const { return path_; }
  // Whether both have the same rules, whatever else stands in their files.
  [[nodiscard]] bool has_rules_of(const Policy& other) const;
  // As long as this lives.
  [[nodiscard]] std::vector<Pattern> patterns() const;

 private:
  friend class PolicyReader;

  struct Subject {
    enum class Kind : std::uint8_t { kEveryone, kUser, kGroup };
    Kind kind = Kind::kEveryone;
    std::uint32_t id = 0;

    friend bool operator==(const Subject&, const Subject&) = default;
    [[nodiscard]] bool includes(const Identity& who) const;
    [[nodiscard]] bool covers(const Subject& other) const;
  };
  struct Rule {
    bool allows = false;
    Subject who;
    std::uint16_t actions = 0;  // a bit for each
    std::string glob;           // of ports; what is about no port does not look at it
    std::uint32_t line = 1;
    std::string text;                      // as written, for messages
    std::optional<rules::Location> where;  // of the glob; nothing: there is none

    [[nodiscard]] bool covers(const Rule& later) const;
    [[nodiscard]] bool decides_as(const Rule& other) const {
      return allows == other.allows && who == other.who && actions == other.actions &&
             glob == other.glob;
    }
  };

  std::string path_;  // empty: the default
  uid_t owner_;
  std::vector<Rule> rules_;
};

}  // namespace arbiter::service
