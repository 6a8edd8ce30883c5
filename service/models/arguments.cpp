#include "service/models/arguments.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace arbiter::service {
namespace {

struct Given {
  std::string name;  // empty: none
  std::string file;
};

Given given_by(const std::string& argument) {
  const auto equals = argument.find('=');
  const std::string name = argument.substr(0, equals);
  if (equals == std::string::npos || name.find('/') != std::string::npos) return {"", argument};
  if (!is_model_name(name)) {
    throw std::invalid_argument("\"" + argument + "\": \"" + name +
                                "\" is no name for a model: use at most " +
                                std::to_string(kMaxModelName) +
                                " letters, digits, '_', '.' and '-', not beginning with '-'; where "
                                "this is the name of a file, write: './" +
                                argument + "'");
  }
  if (equals + 1 == argument.size()) {
    throw std::invalid_argument("\"" + argument + "\" names no file; write: " + argument + "FILE");
  }
  return {name, argument.substr(equals + 1)};
}

NamedFiles* find(std::vector<NamedFiles>& models, const std::string& name) {
  const auto found = std::find_if(models.begin(), models.end(),
                                  [&](const auto& each) { return each.name == name; });
  return found == models.end() ? nullptr : &*found;
}

}  // namespace

std::vector<NamedFiles> named_files(const std::vector<std::string>& models,
                                    const std::vector<std::string>& applications) {
  std::vector<NamedFiles> named;
  for (const std::string& argument : models) {
    Given given = given_by(argument);
    if (given.name.empty()) given.name = kDefaultModel;
    NamedFiles* model = find(named, given.name);
    if (model == nullptr) model = &named.emplace_back(NamedFiles{given.name, {}});
    model->files.models.push_back(std::move(given.file));
  }
  if (named.size() > kMaxModels) {
    throw std::invalid_argument("there are " + std::to_string(named.size()) +
                                " models; there can be " + std::to_string(kMaxModels));
  }
  std::optional<std::string> common;  // of those that have none of their own
  for (const std::string& argument : applications) {
    Given given = given_by(argument);
    NamedFiles* const model = given.name.empty() ? nullptr : find(named, given.name);
    if (!given.name.empty() && model == nullptr) {
      throw std::invalid_argument("there is no model \"" + given.name + "\" for the application " +
                                  given.file);
    }
    std::optional<std::string>& place = model == nullptr ? common : model->files.application;
    if (place) throw std::invalid_argument("two applications are given; a model has one at most");
    place = std::move(given.file);
  }
  if (!common) return named;
  if (named.empty()) named.push_back({kDefaultModel, {}});
  for (NamedFiles& each : named) {
    if (!each.files.application) each.files.application = common;
  }
  return named;
}

}  // namespace arbiter::service
