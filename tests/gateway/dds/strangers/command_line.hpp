// What the strangers, programs of DDS that know nothing of Arbiter, have in common.
//
//   STRANGER pub|sub|watch TYPE TOPIC [OPTION…]
//
// TYPE: twist, bool, blob, robot. `pub` publishes a sample for each line of standard input: the
// numbers of its first fields. `sub` writes a line for each sample. Both write "matched N" when N
// others have matched. `watch`, by Cyclone alone, writes what the user data of the topic's readers
// and writers say. OPTION: domain=N (0), reliability=best_effort (reliable), durability=
// transient_local (volatile), depth=N (10), deadline=MILLISECONDS (none), partition=NAME (none),
// name=TYPE_NAME (the type's own), data=USER_DATA (none).
#pragma once

#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <sstream>
#include <string>

namespace strangers {

struct CommandLine {
  bool publishes = false;
  std::string type, topic, partition, type_name, user_data;
  unsigned domain = 0;
  bool reliable = true;
  bool transient_local = false;
  int depth = 10;
  int deadline_ms = 0;
};

inline CommandLine parse(int argc, char** argv) {
  CommandLine result;
  if (argc < 4) std::exit(2);
  result.publishes = std::string(argv[1]) == "pub";
  result.type = argv[2];
  result.topic = argv[3];
  for (int i = 4; i < argc; ++i) {
    const std::string option = argv[i];
    const auto is = option.find('=');
    const std::string name = option.substr(0, is);
    const std::string value = option.substr(is + 1);
    if (name == "domain")
      result.domain = static_cast<unsigned>(std::stoul(value));
    else if (name == "reliability")
      result.reliable = value == "reliable";
    else if (name == "durability")
      result.transient_local = value == "transient_local";
    else if (name == "depth")
      result.depth = std::stoi(value);
    else if (name == "deadline")
      result.deadline_ms = std::stoi(value);
    else if (name == "partition")
      result.partition = value;
    else if (name == "name")
      result.type_name = value;
    else if (name == "data")
      result.user_data = value;
    else
      std::exit(2);
  }
  return result;
}

inline void write_line(const std::string& line) {
  std::fputs((line + "\n").c_str(), stdout);
  std::fflush(stdout);
}

inline void write_matched(int count) { write_line("matched " + std::to_string(count)); }

// The two numbers that a line begins with.
inline bool read_numbers(double& first, double& second) {
  std::string line;
  if (!std::getline(std::cin, line)) return false;
  std::istringstream numbers(line);
  first = second = 0;
  numbers >> first >> second;
  return true;
}

inline void write_numbers(double first, double second) {
  std::ostringstream line;
  line.precision(15);
  line << "sample " << first << " " << second;
  write_line(line.str());
}

}  // namespace strangers
