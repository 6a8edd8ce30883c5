// The models that a daemon has read: proved, compiled and laid out as tables, each ready to be put
// in force.
#pragma once

#include <cstdint>
#include <memory>
#include <stdexcept>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "rules/prove/budget.hpp"
#include "rules/prove/compile.hpp"
#include "service/log/findings.hpp"
#include "service/models/arguments.hpp"
#include "service/ports/port_names.hpp"

namespace arbiter::service {

// A model that was refused; the findings have been logged.
class BadModel : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct Model {
  std::string name;
  rules::ModelFiles files;
  rules::CompiledModel compiled;
};
using ModelPointer = std::shared_ptr<const Model>;

// About how many bytes it takes up.
[[nodiscard]] std::size_t size_of(const Model& model);

// How each model that is read is proved.
struct Proving {
  std::uint64_t steps = rules::Budget::kSteps;
  rules::Budget::Watch watch;  // is called in the compiler's thread
  bool is_strict = false;      // takes warnings for errors
};

// Reads, proves and compiles each; all problems of all files are added in one go. The result is to
// be used only if there is no error. In any thread; throws rules::Stopped.
[[nodiscard]] std::vector<ModelPointer> read_models(const std::vector<NamedFiles>& named,
                                                    const Proving& proving,
                                                    const std::stop_token& stop,
                                                    Findings& findings);

// A model as the words of its table. The names in it keep their ids for as long as this lives.
class Layout {
 public:
  // Throws BadModel, where the instance has no room for the names; std::system_error.
  Layout(const rules::CompiledModel& model, PortNames& names);

  [[nodiscard]] const std::vector<shm::Word>& words() const { return words_; }
  // That the table of that generation names what this does.
  void mark_used(std::uint64_t generation) const;

 private:
  // What was taken before a limit was met has to be given back, too.
  class Pins {
   public:
    Pins() = default;
    Pins(const Pins&) = delete;
    Pins& operator=(const Pins&) = delete;
    ~Pins();
    shm::SourceId pin(Source& source);
    shm::PortId pin(InputName& input);
    std::vector<Source*> sources;
    std::vector<InputName*> inputs;
  };
  Pins pins_;
  std::vector<shm::Word> words_;
};

struct LoadedModel {
  ModelPointer model;
  std::shared_ptr<const Layout> layout;
};

// Those that a daemon can switch between. A value: a reload makes another, which takes its place
// once its model is in force.
class Library {
 public:
  Library() = default;
  // Throws as Layout.
  Library(std::vector<ModelPointer> models, PortNames& names);

  [[nodiscard]] const LoadedModel* find(std::string_view name) const;
  // Null where there is none.
  [[nodiscard]] const LoadedModel* first() const;
  [[nodiscard]] const std::vector<LoadedModel>& models() const { return models_; }
  // "a, b and c"
  [[nodiscard]] std::string names() const;

 private:
  std::vector<LoadedModel> models_;
};

}  // namespace arbiter::service
