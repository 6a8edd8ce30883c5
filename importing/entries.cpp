#include "importing/entries.hpp"

#include <algorithm>
#include <array>
#include <set>
#include <utility>

#include "importing/numbers.hpp"
#include "importing/topic_names.hpp"
#include "rules/text/names.hpp"
#include "shm/limits.hpp"
#include "shm/utf8.hpp"

namespace arbiter::importing {
namespace {

constexpr std::size_t kMaxNameBytes = 128;
// Nobody has a robot obey its last message for so long.
constexpr shm::Nanoseconds kLikelyMilliseconds = 50'000'000'000;

// A name becomes a behaviour's: it is seen in messages and logs.
std::string find_problem_in_name(const std::string& name) {
  if (name.empty()) return "the name is empty; write one";
  if (name.size() > kMaxNameBytes) {
    return "the name " + rules::quote(name) + " is longer than " + std::to_string(kMaxNameBytes) +
           " bytes; shorten it";
  }
  for (std::size_t i = 0; i < name.size();) {
    const shm::Utf8Character character = shm::decode_utf8(std::string_view(name).substr(i));
    const bool is_seen = character.length > 0 && !shm::is_control(character.code) &&
                         !shm::is_invisible(character.code);
    if (!is_seen) {
      return "the name " + rules::quote(name) + " has a character that nobody sees; remove it";
    }
    i += character.length;
  }
  return "";
}

class EntryReader {
 public:
  EntryReader(const EntryRules& rules, bool names_inside, rules::Diagnostics& diagnostics)
      : rules_(rules), names_inside_(names_inside), diagnostics_(diagnostics) {}

  // Nothing if something is wrong with it, which has been reported.
  std::optional<MuxEntry> read(const YamlNode& map, const YamlNode* key) {
    if (!map.is_map()) {
      error("wrong-type", map.where, "an entry has `topic`, `timeout` and `priority`; write these");
      return {};
    }
    MuxEntry entry;
    entry.where = key != nullptr ? key->where : map.where;
    bool is_good = read_name(map, key, entry);
    is_good = read_topic(map, entry) && is_good;
    is_good = read_timeout(map, entry) && is_good;
    is_good = read_priority(map, entry) && is_good;
    if (const YamlEntry* text = map.find("short_desc"); text != nullptr && rules_.has_description) {
      entry.description = rules::collapse_blanks(text->value.text);
    }
    warn_of_unknown_keys(map);
    if (!is_good) return {};
    return entry;
  }

 private:
  void error(const char* code, const rules::Location& where, const std::string& message) {
    diagnostics_.error(code, where, message);
  }

  const YamlEntry* require(const YamlNode& map, const MuxEntry& entry, const char* key) {
    const YamlEntry* found = map.find(key);
    if (found != nullptr && !found->value.is_null()) return found;
    const std::string of = entry.name.empty() ? "this entry" : rules::quote(entry.name);
    error("missing-value", found != nullptr ? found->key.where : entry.where,
          of + " has no `" + key + "`; " + rules_.program + " does not work without it: add it");
    return nullptr;
  }

  bool read_name(const YamlNode& map, const YamlNode* key, MuxEntry& entry) {
    if (key == nullptr) {
      const YamlEntry* name = require(map, entry, "name");
      if (name == nullptr) return false;
      key = &name->value;
    }
    if (!key->is_scalar()) {
      error("wrong-type", key->where, "a name is a word; write one");
      return false;
    }
    entry.name = rules::collapse_blanks(key->text);
    const std::string problem = find_problem_in_name(entry.name);
    if (!problem.empty()) error("invalid-name", key->where, problem);
    return problem.empty();
  }

  bool read_topic(const YamlNode& map, MuxEntry& entry) {
    const YamlEntry* found = require(map, entry, "topic");
    if (found == nullptr) return false;
    entry.topic = {found->value.text, found->value.where};
    if (!found->value.is_scalar() || found->value.text.empty()) {
      error("wrong-type", found->value.where, "a topic is a name, such as /cmd_vel_nav; write one");
      return false;
    }
    // Below any node: its own name may make a longer one of it than there may be.
    const auto topic = resolve_topic(entry.topic.value, {"/", "mux"}, Relative::kToNamespace);
    if (!topic) error("invalid-topic", found->value.where, problem_of_topic(entry.topic.value));
    return topic.has_value();
  }

  bool read_timeout(const YamlNode& map, MuxEntry& entry) {
    const YamlEntry* found = require(map, entry, "timeout");
    if (found == nullptr) return false;
    const auto seconds = read_seconds(found->value);
    if (!seconds.value) {
      error("invalid-timeout", found->value.where, "timeout: " + seconds.problem);
      return false;
    }
    if (const auto problem = rules_.problem_of_timeout(*seconds.value); !problem.empty()) {
      error("invalid-timeout", found->value.where, "timeout: " + problem);
      return false;
    }
    entry.timeout = {*seconds.value, found->value.where};
    if (*seconds.value >= kLikelyMilliseconds) {
      diagnostics_.warning("long-timeout", found->value.where,
                           "a timeout counts seconds: this is " + in_seconds(*seconds.value) +
                               ", for which the last message counts; if you mean milliseconds, "
                               "divide by a thousand");
    }
    if (rules_.wants_fraction && is_whole(found->value)) {
      diagnostics_.warning("whole-timeout", found->value.where,
                           rules_.program +
                               " refuses a timeout that is written as a whole number, "
                               "and does not start; it is taken for " +
                               in_seconds(*seconds.value) + " here: write " + found->value.text +
                               ".0");
    }
    return true;
  }

  bool read_priority(const YamlNode& map, MuxEntry& entry) {
    const YamlEntry* found = require(map, entry, "priority");
    if (found == nullptr) return false;
    const auto number = read_integer(found->value);
    if (!number.value) {
      error("invalid-priority", found->value.where, "priority: " + number.problem);
      return false;
    }
    if (const auto problem = rules_.problem_of_priority(*number.value); !problem.empty()) {
      error("invalid-priority", found->value.where, "priority: " + problem);
      return false;
    }
    entry.priority = {*number.value, found->value.where};
    return true;
  }

  void warn_of_unknown_keys(const YamlNode& map) {
    std::vector<std::string_view> known{"topic", "timeout", "priority"};
    if (names_inside_) known.emplace_back("name");
    if (rules_.has_description) known.emplace_back("short_desc");
    for (const YamlEntry& entry : map.entries) {
      const std::string& key = entry.key.text;
      if (std::find(known.begin(), known.end(), key) != known.end()) continue;
      diagnostics_.warning("unknown-key", entry.key.where,
                           rules_.program + " does not read " + rules::quote(key) +
                               ", nor does the import" +
                               rules::advise(key, known, "remove it, or correct its name"));
    }
  }

  const EntryRules& rules_;
  const bool names_inside_;
  rules::Diagnostics& diagnostics_;
};

// In ROS 2 entries are parameters, which are sorted, and the first one of an entry counts:
// "topics.a-b.priority" is before "topics.a.priority", and so is "topics.a.b.priority".
void sort_as_ros2(std::vector<MuxEntry>& entries) {
  std::stable_sort(entries.begin(), entries.end(), [](const MuxEntry& a, const MuxEntry& b) {
    return a.name + ".priority" < b.name + ".priority";
  });
}

void require_names_of_their_own(std::vector<MuxEntry>& entries, const EntryRules& rules,
                                rules::Diagnostics& diagnostics) {
  std::set<std::string> names;
  for (const MuxEntry& entry : entries) {
    if (names.insert(entry.name).second) continue;
    diagnostics.error("given-twice", entry.where,
                      "the name " + rules::quote(entry.name) + " is given twice; " + rules.program +
                          " tells entries apart by it: give one another name");
  }
}

}  // namespace

std::vector<MuxEntry> read_entries(const Parameter& parameter, const EntryRules& rules,
                                   rules::Diagnostics& diagnostics) {
  const YamlNode& value = parameter.entry->value;
  std::vector<MuxEntry> entries;
  if (value.is_sequence() && parameter.set->is_ros2) {
    diagnostics.error("wrong-type", value.where,
                      "in ROS 2 `" + parameter.entry->key.text +
                          "` is a map of entries by name, not a list; write it so");
    return entries;
  }
  if (value.is_map() && !parameter.set->is_ros2) {
    diagnostics.error("wrong-type", value.where,
                      "`" + parameter.entry->key.text +
                          "` is a map of entries by name here, as in ROS 2, which reads parameters "
                          "only below `ros__parameters`; put it there, or write a list of entries, "
                          "as ROS 1 has it");
    return entries;
  }
  if (value.is_scalar()) {
    diagnostics.error("wrong-type", value.where,
                      "`" + parameter.entry->key.text + "` has the entries in it; write these");
    return entries;
  }
  const std::size_t count = value.items.size() + value.entries.size();
  if (count > shm::kMaxSourcesPerPort) {
    diagnostics.error("limit-exceeded", value.where,
                      "`" + parameter.entry->key.text + "` has " + std::to_string(count) +
                          " entries, and a port takes at most " +
                          std::to_string(shm::kMaxSourcesPerPort) + " sources; remove some");
    return entries;
  }
  EntryReader reader(rules, value.is_sequence(), diagnostics);
  for (const YamlNode& item : value.items) {
    if (auto entry = reader.read(item, nullptr)) entries.push_back(std::move(*entry));
  }
  for (const YamlEntry& item : value.entries) {
    if (auto entry = reader.read(item.value, &item.key)) entries.push_back(std::move(*entry));
  }
  if (value.is_map()) sort_as_ros2(entries);
  require_names_of_their_own(entries, rules, diagnostics);
  return entries;
}

std::optional<bool> read_boolean(const YamlEntry& entry, rules::Diagnostics& diagnostics) {
  constexpr std::array<std::string_view, 3> kYes{"true", "True", "TRUE"};
  constexpr std::array<std::string_view, 3> kNo{"false", "False", "FALSE"};
  const YamlNode& value = entry.value;
  if (value.is_scalar() && value.is_plain) {
    if (std::find(kYes.begin(), kYes.end(), value.text) != kYes.end()) return true;
    if (std::find(kNo.begin(), kNo.end(), value.text) != kNo.end()) return false;
  }
  diagnostics.error("wrong-type", value.where,
                    "`" + entry.key.text + "` is true or false; write one of them");
  return {};
}

std::string in_seconds(shm::Nanoseconds timeout) {
  const bool is_negative = timeout < 0;
  if (is_negative) timeout = -timeout;
  std::string fraction = std::to_string(1'000'000'000 + timeout % 1'000'000'000).substr(1);
  while (!fraction.empty() && fraction.back() == '0') fraction.pop_back();
  std::string text = is_negative ? "-" : "";
  text += std::to_string(timeout / 1'000'000'000);
  if (!fraction.empty()) text += "." + fraction;
  return text + " s";
}

}  // namespace arbiter::importing
