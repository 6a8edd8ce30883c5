#include "watch/process.hpp"

#include <fstream>
#include <string>

namespace arbiter::watch {

// /proc/PID/stat: "pid (name) state …".
bool is_stopped(int pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/stat");
  std::string text;
  std::getline(file, text);
  const auto end = text.rfind(") ");
  return end != std::string::npos && end + 2 < text.size() &&
         (text[end + 2] == 'T' || text[end + 2] == 't');
}

}  // namespace arbiter::watch
