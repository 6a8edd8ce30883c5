#include "cli/wrong_use.hpp"

#include <algorithm>
#include <string_view>
#include <utility>
#include <vector>

#include "rules/text/names.hpp"
#include "shm/utf8.hpp"

namespace arbiter::cli {
namespace {

using rules::quote;

// The verb that was typed, and its own verb if it has some: "arbiter recording winners".
std::pair<const CLI::App*, std::string> typed_verb(const CLI::App& app) {
  const CLI::App* verb = &app;
  std::string name = app.get_name();
  while (!verb->get_subcommands().empty()) {
    verb = verb->get_subcommands().front();
    name += ' ' + verb->get_name();
  }
  return {verb, name};
}

std::vector<std::string> options_of(const CLI::App& verb) {
  std::vector<std::string> names;
  for (const CLI::Option* option : verb.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
  return names;
}

std::string advice(const std::string& word, const std::vector<std::string>& known) {
  const auto similar = rules::find_similar(word, {known.begin(), known.end()});
  return similar ? "; did you mean " + quote(*similar) + '?' : "";
}

// Empty: there are none.
std::string text_of_options(const CLI::App& verb, const std::string& name) {
  std::string text;
  for (const std::string& word : verb.remaining()) {
    if (!word.starts_with('-')) continue;
    const std::string option = word.substr(0, word.find('='));
    text += (text.empty() ? "" : "\n") + name + " has no option " + quote(option) +
            advice(option, options_of(verb));
  }
  return text;
}

std::string text_of_words(const CLI::App& verb, const std::string& name) {
  const std::vector<std::string> words = verb.remaining();
  std::vector<std::string> quoted(words.size());
  std::transform(words.begin(), words.end(), quoted.begin(),
                 [](const std::string& word) { return quote(word); });
  return name + " has no place for " + rules::enumerate(quoted);
}

std::string text_of_missing_verb(const CLI::App& verb, const std::string& name) {
  std::vector<std::string> names;
  for (const CLI::App* each : verb.get_subcommands([](const CLI::App*) { return true; })) {
    names.push_back(each->get_name());
  }
  const std::vector<std::string> words = verb.remaining();
  const auto word = std::find_if(words.begin(), words.end(),
                                 [](const std::string& each) { return !each.starts_with('-'); });
  if (word == words.end()) {
    return name + " needs a verb: " + rules::enumerate(names);
  }
  return name + " has no verb " + quote(*word) +
         rules::advise(*word, {names.begin(), names.end()}, "it has " + rules::enumerate(names));
}

std::string text_of(const CLI::Error& error, const CLI::App& verb, const std::string& name) {
  const auto is = [&](CLI::ExitCodes code) {
    return error.get_exit_code() == static_cast<int>(code);
  };
  const bool has_words = !verb.remaining().empty();
  if (is(CLI::ExitCodes::ExtrasError) && has_words) return text_of_words(verb, name);
  const bool lacks_verb = verb.get_require_subcommand_min() > 0 && verb.get_subcommands().empty();
  if (is(CLI::ExitCodes::RequiredError) && lacks_verb) return text_of_missing_verb(verb, name);
  return error.what();
}

}  // namespace

std::string wrong_use_text(const CLI::App& app, const CLI::Error& error) {
  const auto [verb, name] = typed_verb(app);
  // What stands behind an unknown option is probably its value, and what is missing may be meant by
  // it.
  std::string text = text_of_options(*verb, name);
  if (text.empty()) text = text_of(error, *verb, name);
  return shm::printable(text + "\nRun `" + name + " --help` for more information.\n", "\n\t");
}

}  // namespace arbiter::cli
