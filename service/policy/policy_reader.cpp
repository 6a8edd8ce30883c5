// Policy::parse(): the reader of policy files.
#include <grp.h>
#include <pwd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <filesystem>
#include <system_error>
#include <utility>

#include "rules/text/names.hpp"
#include "service/policy/policy.hpp"
#include "shm/limits.hpp"
#include "shm/utf8.hpp"

namespace arbiter::service {
namespace {

using rules::advise;
using rules::quote;

struct NamedAction {
  std::string_view name;
  Action action;
  bool on_ports;
};
constexpr std::array<NamedAction, kActionCount> kActions{{
    {"output", Action::kOutput, true},
    {"input", Action::kInput, true},
    {"deactivate", Action::kDeactivate, true},
    {"observe", Action::kObserve, false},
    {"reload", Action::kReload, false},
    {"switch", Action::kSwitch, false},
    {"stop", Action::kStop, false},
    {"replay", Action::kReplay, true},
    {"tap", Action::kTap, true},
}};
constexpr std::string_view kShape = "a line is: allow|deny WHO ACTION[,ACTION...] [GLOB...]";

std::optional<std::uint32_t> to_number(std::string_view text) {
  std::uint32_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc{} || end != text.data() + text.size()) return {};
  // The kernel's word for "no user": nobody is it.
  if (number == UINT32_MAX) return {};
  return number;
}

// Calls getpwnam_r or getgrnam_r with as large a buffer as it asks for.
template <class Entry, class Function>
std::optional<Entry> look_up(Function function, const std::string& name) {
  constexpr std::size_t kMaxBuffer = 1u << 20;  // a group may have many members
  for (std::size_t size = 4096; size <= kMaxBuffer; size *= 4) {
    std::vector<char> buffer(size);
    Entry entry{};
    Entry* found = nullptr;
    const int error = function(name.c_str(), &entry, buffer.data(), buffer.size(), &found);
    if (error == ERANGE) continue;
    if (found == nullptr) return {};
    return entry;  // its strings are gone, its numbers are not
  }
  return {};
}

}  // namespace

std::string line_that_allows(const std::string& user, Action action, std::string_view port) {
  for (const NamedAction& each : kActions) {
    if (each.action != action) continue;
    std::string line = "allow user " + user + ' ' + std::string(each.name);
    if (!each.on_ports) return line;
    if (port.find('*') != std::string_view::npos) return {};
    return line + ' ' + std::string(port);
  }
  return {};
}

std::optional<Action> action_on_no_port(std::string_view name) {
  for (const NamedAction& each : kActions) {
    if (each.name == name && !each.on_ports) return each.action;
  }
  return std::nullopt;
}

Accounts accounts_of_this_machine() {
  return {[](const std::string& name) -> std::optional<uid_t> {
            const auto entry = look_up<passwd>(getpwnam_r, name);
            return entry ? std::optional(entry->pw_uid) : std::nullopt;
          },
          [](const std::string& name) -> std::optional<gid_t> {
            const auto entry = look_up<group>(getgrnam_r, name);
            return entry ? std::optional(entry->gr_gid) : std::nullopt;
          }};
}

class PolicyReader {
 public:
  PolicyReader(const rules::TextFile& file, uid_t owner, const Accounts& accounts,
               rules::Diagnostics& diagnostics)
      : file_(file), accounts_(accounts), diagnostics_(diagnostics), policy_(owner) {
    std::error_code error;  // where it is not known, the path stays as it was given
    policy_.path_ = std::filesystem::absolute(file.path(), error).lexically_normal().string();
    if (error) policy_.path_ = file.path();
    policy_.rules_.clear();
  }

  Policy read() {
    if (!rules::check_characters(file_, diagnostics_)) return std::move(policy_);
    std::string_view rest = file_.content();
    for (std::uint32_t line = 1; !rest.empty() && !is_full_; ++line) {
      const std::size_t end = std::min(rest.find('\n'), rest.size());
      read_line(rest.substr(0, end), line);
      rest.remove_prefix(std::min(end + 1, rest.size()));
    }
    if (policy_.rules_.empty() && !diagnostics_.has_errors()) {
      diagnostics_.error("empty-file", file_.locate(0),
                         "the policy has no lines; if only root and the daemon's own user may do "
                         "anything, write: deny everyone all");
    }
    return std::move(policy_);
  }

 private:
  void error(const std::string& code, std::string_view at, std::string message) {
    diagnostics_.error(code, file_.locate(file_.offset_of(at.data())), std::move(message));
  }

  // The next word of line_, nothing at its end. A word that begins with '#' ends the line.
  std::string_view next_word() {
    while (!line_.empty() && shm::is_blank(line_.front())) line_.remove_prefix(1);
    if (line_.starts_with('#')) line_ = line_.substr(line_.size());
    std::size_t length = 0;
    while (length < line_.size() && !shm::is_blank(line_[length])) ++length;
    const std::string_view word = line_.substr(0, length);
    line_.remove_prefix(length);
    return word;
  }

  void read_line(std::string_view line, std::uint32_t number) {
    line_ = line;
    const std::string_view effect = next_word();
    if (effect.empty()) return;
    Policy::Rule rule;
    rule.line = number;
    rule.allows = effect == "allow";
    if (!rule.allows && effect != "deny") {
      error(
          "unknown-word", effect,
          quote(effect) + " is neither allow nor deny" + advise(effect, {"allow", "deny"}, kShape));
      return;
    }
    const std::size_t begin = file_.offset_of(effect.data());
    const auto who = read_subject();
    if (!who) return;
    rule.who = *who;
    std::vector<std::string_view> globs;
    if (!read_actions(rule, globs)) return;
    const std::string_view last = globs.empty() ? last_action_ : globs.back();
    const std::size_t end = file_.offset_of(last.data()) + last.size();
    rule.text = rules::collapse_blanks(file_.content().substr(begin, end - begin));
    if (rule.text.size() > kMaxShownText) rule.text = rule.text.substr(0, kMaxShownText) + "...";
    if (globs.empty()) return add(rule, effect, "*");
    for (const std::string_view glob : globs) {
      rule.where = file_.locate(file_.offset_of(glob.data()));
      add(rule, glob, glob);
    }
  }

  std::optional<Policy::Subject> read_subject() {
    using Kind = Policy::Subject::Kind;
    const std::string_view word = next_word();
    if (word == "everyone") return Policy::Subject{Kind::kEveryone, 0};
    if (word == "owner") return Policy::Subject{Kind::kUser, policy_.owner_};
    if (word != "user" && word != "group") {
      error("unknown-word", word.empty() ? line_ : word,
            (word.empty() ? "the line ends" : quote(word) + " stands") +
                std::string(" where it must say who: everyone, owner, user NAME or group NAME"));
      return {};
    }
    const std::string_view name = next_word();
    if (name.empty()) {
      error("unknown-" + std::string(word), line_,
            std::string(word) + " must be followed by a name");
      return {};
    }
    const bool is_user = word == "user";
    const auto& find = is_user ? accounts_.user : accounts_.group;
    std::optional<std::uint32_t> id = to_number(name);
    if (!id && name.size() <= shm::kMaxNameLength) id = find(std::string(name));
    if (!id) {
      error("unknown-" + std::string(word), name,
            "this machine has no " + std::string(word) + " " + quote(name) +
                "; correct the name, or make the " + std::string(word) + " first" +
                (name.starts_with("arbiter-") ? ": sudo systemd-sysusers makes those of the units"
                                              : ""));
      return {};
    }
    return Policy::Subject{is_user ? Kind::kUser : Kind::kGroup, *id};
  }

  bool read_actions(Policy::Rule& rule, std::vector<std::string_view>& globs) {
    const std::string_view words = next_word();
    last_action_ = words;
    if (words.empty()) {
      error("unknown-action", line_,
            std::string("the line ends where it must say what; ") + std::string(kShape));
      return false;
    }
    bool on_ports = false, on_daemon = false;
    const bool is_all = words == "all";
    if (is_all) rule.actions = (1u << kActionCount) - 1;
    for (std::string_view rest = words; !is_all;) {
      const std::size_t comma = std::min(rest.find(','), rest.size());
      const NamedAction* action = read_action(rest.substr(0, comma));
      if (action == nullptr) return false;
      rule.actions |= static_cast<std::uint16_t>(1u << static_cast<unsigned>(action->action));
      (action->on_ports ? on_ports : on_daemon) = true;
      if (comma == rest.size()) break;
      rest.remove_prefix(comma + 1);
    }
    if (on_ports && on_daemon) {
      error("mixed-actions", words,
            quote(words) + " joins actions on ports with such as are on none; write two lines");
      return false;
    }
    return read_globs(words, on_ports, globs);
  }

  const NamedAction* read_action(std::string_view word) {
    std::vector<std::string_view> known{"all"};
    for (const NamedAction& action : kActions) {
      if (action.name == word) return &action;
      known.push_back(action.name);
    }
    error(
        "unknown-action", word,
        quote(word) + " is no action" +
            (word == "all"
                 ? std::string("; all stands alone")
                 : advise(word, known,
                          "write output, input, deactivate, replay, tap, observe, "
                          "reload, switch, stop or all, with commas and no blanks between them")));
    return nullptr;
  }

  bool read_globs(std::string_view actions, bool on_ports, std::vector<std::string_view>& globs) {
    bool fine = true;
    for (std::string_view glob = next_word(); !glob.empty(); glob = next_word()) {
      if (!on_ports) {
        error("stray-word", glob,
              quote(glob) + " stands behind " + quote(actions) +
                  (actions == "all" ? ", which is on every port and takes no pattern; write # "
                                      "before a comment, or name the actions, such as output,input"
                                    : ", which is about no port; remove it, or write # before a "
                                      "comment"));
        return false;
      }
      if (!glob.starts_with('/') && !glob.starts_with('*')) {
        error("invalid-glob", glob,
              "no port's name matches " + quote(glob) + ", for each begins with '/'");
        fine = false;
      } else if (glob.size() > shm::kMaxNameLength) {
        error("name-too-long", glob,
              "the pattern " + quote(glob) + " has more bytes than the limit of " +
                  std::to_string(shm::kMaxNameLength) + "; shorten it");
        fine = false;
      }
      if (globs.size() < Policy::kMaxRules + 1) globs.push_back(glob);
    }
    if (on_ports && globs.empty()) {
      error("missing-glob", line_,
            "the line ends where it must say on which ports; write a pattern such as /Arm/*, or * "
            "for all");
      return false;
    }
    return fine;
  }

  void add(Policy::Rule rule, std::string_view at, std::string_view glob) {
    if (is_full_) return;
    rule.glob = glob;
    if (policy_.rules_.size() == Policy::kMaxRules) {
      is_full_ = true;
      error("limit-exceeded", at,
            "the policy has more rules than the limit of " + std::to_string(Policy::kMaxRules) +
                ", each pattern counted; use wider patterns");
      return;
    }
    for (const Policy::Rule& earlier : policy_.rules_) {
      if (!earlier.covers(rule)) continue;
      diagnostics_.warning("never-applies", file_.locate(file_.offset_of(at.data())),
                           "this never counts, for line " + std::to_string(earlier.line) +
                               " matches all of it before; move it up, or remove it");
      break;
    }
    policy_.rules_.push_back(std::move(rule));
  }

  static constexpr std::size_t kMaxShownText = 200;

  const rules::TextFile& file_;
  const Accounts& accounts_;
  rules::Diagnostics& diagnostics_;
  Policy policy_;
  std::string_view line_;         // what is left of it
  std::string_view last_action_;  // the word with the actions
  bool is_full_ = false;
};

Policy Policy::parse(const rules::TextFile& file, uid_t owner, const Accounts& accounts,
                     rules::Diagnostics& diagnostics) {
  return PolicyReader(file, owner, accounts, diagnostics).read();
}

}  // namespace arbiter::service
