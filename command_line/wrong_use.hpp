// What a program says of a command line that it cannot understand: in words of its own, since
// CLI11's name the words in reverse.
//
//   app.failure_message(command_line::wrong_use_text);
//
// In a header, so that it is compiled with each program's own file: CLI11 takes long.
#pragma once

#include <algorithm>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

#include "command_line/shell_word.hpp"
#include "rules/text/names.hpp"
#include "shm/utf8.hpp"

namespace arbiter::command_line {
namespace wrong_use {

// The verb that was typed, and its own verb if it has some: "arbiter recording winners".
struct Typed {
  const CLI::App* verb;
  std::string name;
};

inline Typed typed_verb(const CLI::App& app) {
  Typed typed{&app, app.get_name()};
  while (!typed.verb->get_subcommands().empty()) {
    typed.verb = typed.verb->get_subcommands().front();
    typed.name += ' ' + typed.verb->get_name();
  }
  return typed;
}

inline std::vector<const CLI::App*> verbs_of(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App*) { return true; });
}

inline std::vector<std::string> options_of(const CLI::App& verb) {
  std::vector<std::string> names;
  for (const CLI::Option* option : verb.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
  return names;
}

inline bool has_option(const CLI::App& verb, const std::string& option) {
  const auto names = options_of(verb);
  return std::find(names.begin(), names.end(), option) != names.end();
}

inline std::string option_in(const std::string& word) { return word.substr(0, word.find('=')); }

inline std::string suggestion(const std::string& word, const std::vector<std::string>& known) {
  const auto similar = rules::find_similar(word, {known.begin(), known.end()});
  return similar ? "; did you mean " + rules::quote(*similar) + '?' : "";
}

// Empty: there are none.
inline std::string text_of_options(const CLI::App& verb, const std::string& name) {
  std::string text;
  for (const std::string& word : verb.remaining()) {
    if (!word.starts_with('-')) continue;
    const std::string option = option_in(word);
    text += (text.empty() ? "" : "\n") + name + " has no option " + rules::quote(option) +
            suggestion(option, options_of(verb));
  }
  return text;
}

// Of an option in front of the verb that has it: `arbiter --instance x status`. Empty: there is
// none.
inline std::string text_of_early_options(const CLI::App& app) {
  const Typed typed = typed_verb(app);
  const auto verbs = verbs_of(app);
  for (const std::string& word : app.remaining()) {
    const std::string option = option_in(word);
    if (!word.starts_with('-') || has_option(app, option)) continue;
    const bool is_typed = typed.verb != &app;
    const bool is_known =
        is_typed ? has_option(*typed.verb, option)
                 : std::any_of(verbs.begin(), verbs.end(),
                               [&](const CLI::App* each) { return has_option(*each, option); });
    if (!is_known) continue;
    std::string line = is_typed ? typed.name : app.get_name() + " VERB";
    for (const std::string& each : app.remaining()) line += ' ' + each;
    return "the options of a verb go after it; write: " + line;
  }
  return {};
}

inline bool takes_words(const CLI::App& verb) {
  const auto options = verb.get_options();
  return std::any_of(options.begin(), options.end(),
                     [](const CLI::Option* each) { return each->get_positional(); });
}

// What words that stand where none are taken, or other ones, were probably meant to be: the values
// of options. `missing` is one that must be there; empty: there is none such.
inline std::string meant(const CLI::App& verb, const std::vector<std::string>& words,
                         const std::string& missing) {
  const bool takes_others = takes_words(verb);
  for (const std::string& word : words) {
    std::string option = takes_others ? "" : missing;
    if (word.ends_with(".mcap") && has_option(verb, "--recording")) option = "--recording";
    if (word.ends_with(".csv") && has_option(verb, "--trace")) option = "--trace";
    // A model is a plain argument of some programs, and not of others.
    const bool is_model = word.ends_with(".xml") && !takes_others;
    if (is_model && has_option(verb, "--model")) option = "--model";
    if (!option.empty()) return "; did you mean " + option + ' ' + shell_word(word) + '?';
  }
  return {};
}

inline std::string text_of_words(const CLI::App& verb, const std::string& name) {
  const std::vector<std::string> words = verb.remaining();
  std::vector<std::string> quoted;
  quoted.reserve(words.size());
  for (const std::string& word : words) quoted.push_back(rules::quote(word));
  return name + " has no place for " + rules::enumerate(quoted) + meant(verb, words, "");
}

inline std::string text_of_missing_verb(const CLI::App& verb, const std::string& name) {
  std::vector<std::string> names;
  for (const CLI::App* each : verbs_of(verb)) names.push_back(each->get_name());
  const std::vector<std::string> words = verb.remaining();
  const auto word = std::find_if(words.begin(), words.end(),
                                 [](const std::string& each) { return !each.starts_with('-'); });
  if (word == words.end()) {
    return name + " needs a verb: " + rules::enumerate(names);
  }
  return name + " has no verb " + rules::quote(*word) +
         rules::advise(*word, {names.begin(), names.end()}, "it has " + rules::enumerate(names));
}

// `missing`: as CLI11 says it, "--until is required".
inline std::string text_of_missing(const CLI::App& verb, const std::string& missing) {
  std::vector<std::string> words = verb.remaining();
  for (const CLI::Option* option : verb.get_options()) {
    if (!option->get_positional()) continue;
    const auto taken = option->results();
    words.insert(words.end(), taken.begin(), taken.end());
  }
  const std::string option = missing.substr(0, missing.find(' '));
  return missing + meant(verb, words, option.starts_with("--") ? option : "");
}

// The first example that the verb's help has, to be put behind what lacks something else that would
// help.
inline std::string example_of(const CLI::App& verb) {
  const std::string help = verb.get_footer();
  const std::size_t heading = help.find("Example");
  if (heading == std::string::npos) return {};
  const std::size_t begin = help.find("\n  ", heading);
  if (begin == std::string::npos) return {};
  const std::string line = help.substr(begin + 3, help.find('\n', begin + 3) - begin - 3);
  return "; for example: " + line;
}

inline std::string text_of(const CLI::Error& error, const CLI::App& verb, const std::string& name) {
  const auto is = [&](CLI::ExitCodes code) {
    return error.get_exit_code() == static_cast<int>(code);
  };
  const bool has_words = !verb.remaining().empty();
  const bool lacks_verb = verb.get_require_subcommand_min() > 0 && verb.get_subcommands().empty();
  std::string text = error.what();
  if (is(CLI::ExitCodes::ExtrasError) && has_words) {
    text = text_of_words(verb, name);
  } else if (is(CLI::ExitCodes::RequiredError)) {
    if (lacks_verb) return text_of_missing_verb(verb, name);
    text = text_of_missing(verb, text);
  } else {
    return text;
  }
  return text.ends_with('?') ? text : text + example_of(verb);
}

}  // namespace wrong_use

// With its end of line, made printable: what was typed may hold anything. As
// CLI::App::failure_message() takes it.
[[nodiscard]] inline std::string wrong_use_text(const CLI::App* app, const CLI::Error& error) {
  const auto [verb, name] = wrong_use::typed_verb(*app);
  // What stands behind an unknown option is probably its value, and what is missing may be meant by
  // it.
  std::string text = wrong_use::text_of_early_options(*app);
  if (text.empty()) text = wrong_use::text_of_options(*verb, name);
  if (text.empty()) text = wrong_use::text_of(error, *verb, name);
  return shm::printable(text + "\nRun `" + name + " --help` for more information.\n", "\n\t");
}

}  // namespace arbiter::command_line
