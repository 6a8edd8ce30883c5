// The order in which a reader of the files comes upon things.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "rules/text/diagnostic.hpp"

namespace arbiter::rules {

class DocumentOrder {
 public:
  explicit DocumentOrder(const std::vector<std::string>& files) {
    for (const std::string& file : files) places_.emplace(file, places_.size());
  }

  // Whether `a` comes before `b`.
  bool operator()(const Location& a, const Location& b) const {
    return std::tuple(place(a), a.line, a.column) < std::tuple(place(b), b.line, b.column);
  }

 private:
  [[nodiscard]] std::size_t place(const Location& where) const {
    const auto found = places_.find(where.file);
    return found == places_.end() ? places_.size() : found->second;
  }

  std::map<std::string, std::size_t> places_;
};

}  // namespace arbiter::rules
