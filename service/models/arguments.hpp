// Which models a daemon has: those of its command line, each with a name of its own.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "rules/model/load.hpp"
#include "service/kept/model_name.hpp"

namespace arbiter::service {

// What is given without a name is part of this one.
inline constexpr const char* kDefaultModel = "default";
inline constexpr std::size_t kMaxModels = 64;

struct NamedFiles {
  std::string name;
  rules::ModelFiles files;
};

// From what is written behind --model and --application: FILE, or NAME=FILE. Several files of one
// name form one model; the models come in the order of their first files. An application without a
// name is that of all models that have none of their own. What has a '='
// before the first '/' is never a file; such a one is written ./NAME=FILE. Throws
// std::invalid_argument saying what is wrong.
[[nodiscard]] std::vector<NamedFiles> named_files(const std::vector<std::string>& models,
                                                  const std::vector<std::string>& applications);

}  // namespace arbiter::service
