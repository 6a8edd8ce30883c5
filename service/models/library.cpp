#include "service/models/library.hpp"

#include <sys/stat.h>

#include <algorithm>
#include <utility>

#include "rules/model/load.hpp"
#include "rules/prove/flatten.hpp"
#include "shm/assertion.hpp"

namespace arbiter::service {
namespace {

std::size_t size_of(const std::vector<std::string>& names) {
  std::size_t size = names.capacity() * sizeof(std::string);
  for (const std::string& name : names) {
    if (name.capacity() >= sizeof(std::string) / 2) size += name.capacity();
  }
  return size;
}

// Whoever may write a model says who commands.
void warn_if_all_may_write(const std::string& path, rules::Diagnostics& diagnostics) {
  struct stat status {};
  if (stat(path.c_str(), &status) != 0 || !S_ISREG(status.st_mode)) return;  // it is refused
  if ((status.st_mode & S_IWOTH) == 0) return;
  diagnostics.warning("open-to-all", {path, 1, 1},
                      "every user may write this file, and so decide who commands from the next "
                      "reload on; run: chmod o-w " +
                          path);
}

// Of several files in place of one: how they are given. Empty: there are none such.
std::string advice_on_lists(const NamedFiles& model) {
  std::string options;
  for (const std::string& path : model.files.models) {
    for (const std::string& file : rules::files_in(path)) {
      options += " --model " + (model.name == kDefaultModel ? "" : model.name + '=') + file;
    }
  }
  return options.empty() ? "" : "; write:" + options;
}

}  // namespace

std::size_t size_of(const Model& model) {
  const rules::CompiledModel& compiled = model.compiled;
  std::size_t size = sizeof model + size_of(compiled.sources);
  size += compiled.timeouts.size() * 128;
  if (compiled.texts) {
    for (const auto& file : compiled.texts->models) size += file.content.capacity();
    if (compiled.texts->application) size += compiled.texts->application->content.capacity();
  }
  for (const auto& port : compiled.ports) {
    size += sizeof port + size_of(port.reads);
    for (const auto& rule : port.rules) {
      size += sizeof rule + size_of(rule.reads) + rule.expected.size() / 8 +
              rule.nodes.capacity() * sizeof(rule.nodes[0]);
    }
  }
  return size;
}

std::vector<ModelPointer> read_models(const std::vector<NamedFiles>& named, const Proving& proving,
                                      const std::stop_token& stop, Findings& findings) {
  std::vector<ModelPointer> models;
  for (const NamedFiles& each : named) {
    if (stop.stop_requested()) throw rules::Stopped();
    rules::Diagnostics diagnostics;
    rules::Budget budget(proving.steps, stop);
    budget.watch(proving.watch);
    auto model = std::make_shared<Model>();
    model->name = each.name;
    model->files = each.files;
    for (const std::string& path : each.files.models) warn_if_all_may_write(path, diagnostics);
    if (each.files.application) warn_if_all_may_write(*each.files.application, diagnostics);
    try {
      const rules::RuleSet rules =
          rules::load(rules::read_texts(each.files, rules::Accept::kRegularFile), diagnostics);
      model->compiled = rules::compile(rules, diagnostics, budget);
    } catch (const rules::FileError& error) {
      findings.add_failure(error.what() + advice_on_lists(each));
    }
    findings.add(named.size() == 1 ? "the model" : "the model " + each.name,
                 std::move(diagnostics));
    models.push_back(std::move(model));
  }
  return models;
}

Layout::Pins::~Pins() {
  const auto unpin = [](std::uint32_t& pins) {
    ARBITER_ASSERT(pins != 0, "a name is let go more often than it was kept");
    --pins;
  };
  for (Source* source : sources) unpin(source->pins);
  for (InputName* input : inputs) unpin(input->pins);
}

shm::SourceId Layout::Pins::pin(Source& source) {
  sources.push_back(&source);
  ++source.pins;
  return source.id;
}

shm::PortId Layout::Pins::pin(InputName& input) {
  inputs.push_back(&input);
  ++input.pins;
  return input.id;
}

Layout::Layout(const rules::CompiledModel& model, PortNames& names) {
  try {
    words_ = rules::flatten(
        model, {[&](const std::string& name) { return pins_.pin(names.source(name)); },
                [&](const std::string& name) { return pins_.pin(names.input(name)); }});
  } catch (const std::length_error& error) {
    throw BadModel(error.what());
  }
}

void Layout::mark_used(std::uint64_t generation) const {
  for (Source* source : pins_.sources) source->used_by_generation = generation;
  for (InputName* input : pins_.inputs) input->used_by_generation = generation;
}

Library::Library(std::vector<ModelPointer> models, PortNames& names) {
  for (ModelPointer& model : models) {
    auto layout = std::make_shared<const Layout>(model->compiled, names);
    models_.push_back({std::move(model), std::move(layout)});
  }
}

const LoadedModel* Library::find(std::string_view name) const {
  const auto found = std::find_if(models_.begin(), models_.end(),
                                  [&](const auto& each) { return each.model->name == name; });
  return found == models_.end() ? nullptr : &*found;
}

const LoadedModel* Library::first() const { return models_.empty() ? nullptr : &models_.front(); }

std::string Library::names() const {
  std::string names;
  for (std::size_t i = 0; i < models_.size(); ++i) {
    if (i != 0) names += i + 1 == models_.size() ? " and " : ", ";
    names += models_[i].model->name;
  }
  return names;
}

}  // namespace arbiter::service
