#include "rules/model/hosts.hpp"

#include "rules/text/names.hpp"

namespace arbiter::rules {
namespace {

bool ends_word(std::string_view name, std::size_t end) noexcept {
  return end == name.size() || name[end] == '/' || name[end] == ':';
}

}  // namespace

bool begins_with_prefix(std::string_view name, std::string_view prefix) noexcept {
  return name.starts_with(prefix) && ends_word(name, prefix.size());
}

Hosts::Hosts(const Application& application) {
  for (const Module& module : application.modules) {
    for (const std::string& prefix : module.prefixes) {
      auto& modules = by_prefix_[prefix];
      if (modules.empty()) prefixes_.push_back(prefix);
      // --name and <prefix> of one module are often the same.
      if (modules.empty() || modules.back() != &module) modules.push_back(&module);
    }
  }
}

const std::vector<const Module*>& Hosts::modules_of(std::string_view port) const {
  static const std::vector<const Module*> none;
  for (std::size_t end = port.size(); end > 1; --end) {
    if (!ends_word(port, end)) continue;
    const auto found = by_prefix_.find(port.substr(0, end));
    if (found != by_prefix_.end()) return found->second;
  }
  return none;
}

std::string Hosts::meant_by(std::string_view port) const {
  for (std::size_t end = 2; end < port.size(); ++end) {
    if (!ends_word(port, end)) continue;
    const auto similar = find_similar(port.substr(0, end), prefixes_);
    if (similar) return *similar + std::string(port.substr(end));
  }
  return "";
}

}  // namespace arbiter::rules
