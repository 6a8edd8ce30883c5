// On which host each port is, by the modules of an application file.
//
// A YARP module names its ports itself, and all of them begin alike: by what its <parameters> say
// behind --name, by its <prefix>, or, if it has neither, by its <name>. So a port belongs to the
// module with the longest of these that its name begins with, as whole words: "/Arm/pos:i" begins
// with "/Arm", and not with "/Ar".
#pragma once

#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "rules/model/model.hpp"

namespace arbiter::rules {

using Module = Application::Module;

class Hosts {
 public:
  // Keeps views of it.
  explicit Hosts(const Application& application);

  // The modules that the port belongs to, in document order: several if they are called alike.
  [[nodiscard]] const std::vector<const Module*>& modules_of(std::string_view port) const;

  // The name that the port would have, had it been misspelt in what its module is called; or "".
  [[nodiscard]] std::string meant_by(std::string_view port) const;

 private:
  std::unordered_map<std::string_view, std::vector<const Module*>> by_prefix_;
  std::vector<std::string_view> prefixes_;
};

// Whether the name begins with the prefix, as whole words.
[[nodiscard]] bool begins_with_prefix(std::string_view name, std::string_view prefix) noexcept;

}  // namespace arbiter::rules
