#include "client/node/names.hpp"

#include <string>

#include <arbiter/result.hpp>

#include "shm/limits.hpp"
#include "shm/utf8.hpp"

namespace arbiter::detail {

void check_name(std::string_view name, const char* what) {
  const auto refuse = [&](const std::string& why) {
    throw Error("\"" + shm::printable(name) + "\" is not a name for " + what + ": " + why);
  };
  if (name.empty() || name.size() > shm::kMaxNameLength) {
    refuse("use 1 to " + std::to_string(shm::kMaxNameLength) + " bytes");
  }
  if (const auto fault = shm::find_fault_in_name(name)) {
    refuse("it has " + std::string(fault->what) + " in it");
  }
}

void check_port_name(std::string_view name) {
  check_name(name, "a port");
  if (name[0] != '/') throw Error("\"" + std::string(name) + "\": a port's name begins with '/'");
}

}  // namespace arbiter::detail
