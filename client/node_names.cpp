#include "client/node_names.hpp"

#include <cxxabi.h>

#include <cstdio>
#include <cstdlib>

#include "shm/limits.hpp"
#include "shm/utf8.hpp"

namespace arbiter::detail {
namespace {

std::string readable(const char* type_name) {
  int status = 0;
  char* const demangled = abi::__cxa_demangle(type_name, nullptr, nullptr, &status);
  std::string result = status == 0 ? demangled : type_name;
  std::free(demangled);  // NOLINT: that is how __cxa_demangle hands it out
  return result;
}

// A name that is too long ends in a hash of the whole, so that two that differ stay different.
std::string fitting(std::string name) {
  if (name.size() <= shm::kMaxTypeName) return name;
  std::uint64_t hash = 0xcbf29ce484222325;  // FNV-1a: the same in every program
  for (const char c : name) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3;
  char tail[20];
  const int length = std::snprintf(tail, sizeof tail, "...%016llx", 0ULL + hash);
  return name.substr(0, shm::kMaxTypeName - static_cast<std::size_t>(length)) + tail;
}

}  // namespace

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

shm::TypeInfo type_info(const PortType& type) {
  shm::TypeInfo info;
  if (type.name != nullptr) info.set_name(fitting(readable(type.name)));
  info.size = type.size;
  info.alignment = type.alignment;
  return info;
}

}  // namespace arbiter::detail
