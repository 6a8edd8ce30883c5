// The files of a model, as they were read: what a model in force can be told from later, when the
// files may say something else.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace arbiter::rules {

struct FileText {
  std::string path;
  std::string content;
};

struct ModelTexts {
  std::vector<FileText> models;  // together they form one model
  std::optional<FileText> application;
};

}  // namespace arbiter::rules
