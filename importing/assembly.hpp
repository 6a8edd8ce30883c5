// What both imports do alike: names of topics and ports that fit and meet nothing twice.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "importing/entries.hpp"
#include "importing/import.hpp"
#include "importing/plan.hpp"
#include "importing/topic_names.hpp"

namespace arbiter::importing {

class Assembly {
 public:
  Assembly(const NodeParameters& parameters, const ImportOptions& options, std::string default_node,
           Relative relative, rules::Diagnostics& diagnostics);

  // Reports a name that is none, or that an earlier entry has.
  std::string topic_of(const MuxEntry& entry);
  // Behind all entries: the way out. `written` is what the file or the program calls it.
  void set_output(Plan& plan, const std::string& written, const rules::Location& where);
  // "/joystick": where the ports of an entry are. A topic and a lock of one name share it.
  enum class Of { kTopic, kLock };
  std::string folder_of(const MuxEntry& entry, Of what);
  // The behaviour's name: the entry's, but for what means something to an <inhibition> or a define.
  std::string behaviour_of(const MuxEntry& entry);

  // Type and idle; `is_stamped`: the file says so.
  void set_types(Plan& plan, bool is_stamped, const rules::Location& where);

 private:
  const ImportOptions& options_;
  NodeName node_;
  Relative relative_;
  bool is_ros2_;
  rules::Diagnostics& diagnostics_;
  std::map<std::string, rules::Location> topics_;  // of inputs
  std::map<Of, std::set<std::string>> folders_;
  std::set<std::string> behaviours_;
};

std::vector<std::string> file_names(const std::vector<InputFile>& files);

}  // namespace arbiter::importing
