// The picture that arbiter graph makes of a model.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "drawing/drawing.hpp"
#include "drawing/places.hpp"
#include "rules/model/load.hpp"
#include "shm/file_descriptor.hpp"

namespace arbiter::cli {

struct GraphOptions {
  rules::ModelFiles files;
  std::string view = "auto";
  std::vector<std::string> ports;
  std::string format;
  std::string output;
  std::string instance;
  std::string dpi;
  std::string hosts;  // an application that says where modules run
  double effort = 1;
  bool live = false;
  bool follow = false;
};

// Thrown where somebody has had enough of waiting for Graphviz.
struct PictureInterrupted {};

class Picture {
 public:
  // Throws CLI::ValidationError where the options ask for what there is not.
  explicit Picture(const GraphOptions& options);

  // What is wrong with the model goes to standard error. False if it cannot be drawn. `in_force`
  // says for the title what the daemon does with it. Throws std::runtime_error where it lacks a
  // port of which a picture is wanted.
  bool load(const rules::ModelTexts& texts, const std::string& in_force = {});

  // If not, rules contradict each other: to see where is what one may draw them for.
  [[nodiscard]] bool is_good() const { return is_good_; }

  // While Graphviz is at work, too: write() throws PictureInterrupted once they are readable.
  void heed(const shm::FileDescriptor& interrupts) { interrupts_ = &interrupts; }

  // All of them, drawn or not.
  [[nodiscard]] const rules::RuleSet& rules() const { return model_.rules; }

  // Where nothing has changed, nothing is written. `places`: null, and they are as --hosts
  // says. Throws rules::FileError, std::runtime_error.
  void write(const drawing::Situation* situation, const drawing::Places* places = nullptr);

 private:
  void check();
  void choose_view();
  void find_places();
  void set_title(const rules::ModelTexts& texts, const std::string& in_force);
  [[nodiscard]] std::string lay_out(const std::string& text) const;

  const GraphOptions& options_;
  const shm::FileDescriptor* interrupts_ = nullptr;
  const std::string format_;
  drawing::Page page_;
  rules::LoadedModel model_;
  std::optional<rules::LoadedModel> part_;  // of it, where only that is wanted
  std::optional<drawing::Places> places_;   // by the application, not by links
  drawing::View view_ = drawing::View::kBehaviours;
  bool is_good_ = false;
  std::string last_;
};

// The formats of pictures, for the help.
inline constexpr const char* kGraphFormats = "svg, png, dot, pdf, ps, eps or jpg";

}  // namespace arbiter::cli
