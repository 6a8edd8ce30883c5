// As what arbiter pub opens its port: a type from the command line, or that of a running port.
#pragma once

#include <optional>
#include <string>

#include <arbiter/type.hpp>

#include "shm/type_info.hpp"
#include "wire/status.hpp"

namespace arbiter::cli {

// How a type is written on a command line.
inline constexpr const char* kTypeForm = "NAME:SIZE:ALIGN";

// "arbiter::Number:8:8". The name may have colons. Throws CLI::ValidationError.
[[nodiscard]] Type parse_type(const std::string& text);

// The type that an input or output port of that name has; of a source that nobody has open, the one
// that its input ports take. Throws std::runtime_error where there is no such type, or several: the
// message says what to do.
[[nodiscard]] Type type_like(const wire::Status& status, const std::string& port);

// The type of all typed input ports that are open and connected to that source. Nothing: there is
// none, they differ, or its samples have no size of their own.
[[nodiscard]] std::optional<Type> type_of_receivers(const wire::Status& status,
                                                    const std::string& source);

// "geometry/Twist (48 bytes, aligned to 8)".
[[nodiscard]] std::string describe(const Type& type);
[[nodiscard]] std::string describe(const wire::SampleType& type);
[[nodiscard]] bool is_same(const wire::SampleType& one, const Type& other);

}  // namespace arbiter::cli
