// The line of a file that a finding is about, with a caret below the place.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "rules/text/diagnostic.hpp"

namespace arbiter::rules {

// Files are read again, once each, since findings outlive what was read. Where one is gone, is no
// regular file or has been changed so that the place is not in it, there is no excerpt.
class Excerpts {
 public:
  // Columns of a line that are shown; of a longer one, those around the place.
  static constexpr std::size_t kMaxColumns = 100;

  // Two lines:
  //     12 |   <condition>not /c or</condition>
  //        |                      ^
  // Nothing if there is none.
  std::string at(const Location& where);

 private:
  struct File {
    std::string content;
    std::vector<std::size_t> line_starts;
  };

  const File& file(const std::string& path);

  std::map<std::string, File> files_;
};

}  // namespace arbiter::rules
