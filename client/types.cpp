#include "client/types.hpp"

#include <cxxabi.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>

#include <arbiter/result.hpp>

#include "shm/utf8.hpp"

namespace arbiter {
namespace detail {
namespace {

std::string readable(const char* mangled_name) {
  int status = 0;
  char* const demangled = abi::__cxa_demangle(mangled_name, nullptr, nullptr, &status);
  std::string result = status == 0 ? demangled : mangled_name;
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
  const std::size_t room = shm::kMaxTypeName - static_cast<std::size_t>(length);
  return std::string(shm::beginning_of(name, room)) + tail;
}

}  // namespace

Type type_of_cpp(const char* mangled_name, std::size_t size, std::size_t alignment) {
  return {fitting(readable(mangled_name)), size, alignment};
}

shm::TypeInfo as_info(const Type& type) noexcept {
  shm::TypeInfo info;
  info.set_name(type.name());
  info.size = type.size();
  info.alignment = type.alignment();
  return info;
}

Type as_type(const shm::TypeInfo& info) {
  if (!info.is_typed()) return Type::untyped(info.size);
  return {info.type_name(), info.size, info.alignment};
}

}  // namespace detail

Type::Type(std::string_view name, std::size_t size, std::size_t alignment)
    : name_(name), size_(size), alignment_(alignment) {
  const auto refuse = [&](const std::string& why) {
    throw Error("\"" + shm::printable(name) + "\" cannot be a port's type: " + why);
  };
  if (name.empty() || name.size() > shm::kMaxTypeName) {
    refuse("its name must have 1 to " + std::to_string(shm::kMaxTypeName) + " bytes");
  }
  // In memory it would end there; where that is at once, the port would be untyped.
  if (name.find('\0') != std::string_view::npos) refuse("its name has a zero byte in it");
  if (const auto fault = shm::fault_of(detail::as_info(*this))) refuse(*fault);
}

Type::Type(Untyped untyped) noexcept
    : size_(untyped.max_size), alignment_(untyped.max_size == 0 ? 1 : alignof(std::max_align_t)) {}

Type Type::untyped(std::size_t max_size) noexcept { return Type(Untyped(max_size)); }

}  // namespace arbiter
