#include "service/clients/given_names.hpp"

#include <stdexcept>

#include "shm/utf8.hpp"

namespace arbiter::service {

void require_fine(std::string_view name, const char* whose) {
  if (const auto fault = shm::find_fault_in_name(name)) {
    throw std::runtime_error(std::string(whose) + " name \"" + shm::printable(name) + "\" has " +
                             fault->what + " in it");
  }
}

std::string port_name(const wire::Message& message) {
  const std::string_view name = message.name_view();
  if (name.empty() || name[0] != '/') throw std::runtime_error("a port's name begins with '/'");
  require_fine(name, "the port's");
  return std::string(name);
}

}  // namespace arbiter::service
