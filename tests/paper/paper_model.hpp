// A model given as text, loaded, extracted and compiled.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "rules/ask/report.hpp"
#include "rules/model/load.hpp"
#include "rules/model/print_rules.hpp"
#include "rules/prove/compile.hpp"
#include "tests/support/live_table.hpp"
#include "tests/support/temporary_directory.hpp"

namespace arbiter::test {

struct PaperModel {
  rules::RuleSet rules;
  rules::Diagnostics diagnostics;
  rules::CompiledModel compiled;
  std::unique_ptr<LiveTable> live;  // if there is no error

  [[nodiscard]] std::vector<std::string> codes() const {
    std::vector<std::string> result;
    for (const auto& item : diagnostics.items()) result.push_back(item.code);
    return result;
  }

  // The rules of a port as the paper writes them, without "⇒ Select(…)".
  [[nodiscard]] std::vector<std::string> rules_at(const std::string& name) const {
    std::vector<std::string> result;
    for (const auto& port : rules.ports) {
      if (port.port != name) continue;
      for (const auto& rule : port.rules) result.push_back(to_string(rule));
    }
    return result;
  }

  // Who wins at a port while just these are active; "-" if nobody does.
  [[nodiscard]] std::string winner(const std::string& port,
                                   const std::set<std::string>& active) const {
    live->activate_only(active);
    return live->winner(port).value_or("-");
  }
};

inline PaperModel load_files(const rules::ModelFiles& files) {
  PaperModel model;
  model.rules = rules::load(files, model.diagnostics);
  if (model.diagnostics.has_errors()) return model;
  model.compiled = rules::compile(model.rules, model.diagnostics);
  if (!model.diagnostics.has_errors()) model.live = std::make_unique<LiveTable>(model.compiled);
  return model;
}

inline PaperModel load_text(const std::string& text,
                            const std::optional<std::string>& application = {}) {
  const TemporaryDirectory directory;
  rules::ModelFiles files{{directory.write("model.xml", text)}, {}};
  if (application) files.application = directory.write("application.xml", *application);
  return load_files(files);
}

inline PaperModel search_and_track() {
  const std::string folder = std::string(ARBITER_EXAMPLES) + "/search_and_track";
  return load_files({{folder + "/search_and_track.xml"}, {}});
}

inline const std::string kRandomLook = "/RandomLook/pos:o", kFace = "/Face/pos:o",
                         kObject = "/Object/pos:o", kRestArm = "/RestArm/pos:o",
                         kCollision = "/collision:o";
inline const std::string kGaze = "/Gaze/pos:i", kArm = "/Arm/pos:i";
inline const std::vector<std::string> kAllSources = {kRandomLook, kFace, kObject, kRestArm,
                                                     kCollision};

}  // namespace arbiter::test
