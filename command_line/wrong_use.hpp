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
#include "command_line/values.hpp"
#include "rules/text/names.hpp"
#include "shm/utf8.hpp"

namespace arbiter::command_line {

// Options that a verb does not have, and what does what they ask for.
struct Elsewhere {
  std::string_view verb;  // as it is typed: "arbiter why"
  std::vector<std::string_view> options;
  std::string_view hint;  // said once for all of them
};

namespace wrong_use {

// The verb that was typed, and its own verb if it has some: "arbiter recording winners".
struct Typed {
  const CLI::App* verb;
  std::string name;
  std::vector<std::string> before;  // what stands in front of it, and nothing took
};

inline Typed typed_verb(const CLI::App& app) {
  Typed typed{&app, app.get_name(), {}};
  while (!typed.verb->get_subcommands().empty()) {
    const auto left = typed.verb->remaining();
    typed.before.insert(typed.before.end(), left.begin(), left.end());
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
  return verb.get_option_no_throw(option) != nullptr;
}

inline bool is_given(const CLI::App& verb, const std::string& option) {
  const CLI::Option* const found = verb.get_option_no_throw(option);
  return found != nullptr && found->count() > 0;
}

// Behind "--" there are none.
inline std::vector<std::string> options_in(const std::vector<std::string>& words) {
  std::vector<std::string> options;
  for (const std::string& word : words) {
    if (word == "--") break;
    if (word.starts_with('-')) options.push_back(word.substr(0, word.find('=')));
  }
  return options;
}

inline std::vector<std::string> words_in(const std::vector<std::string>& words) {
  std::vector<std::string> plain;
  bool may_be_options = true;
  for (const std::string& word : words) {
    if (word == "--") may_be_options = false;
    if (word != "--" && !(may_be_options && word.starts_with('-'))) plain.push_back(word);
  }
  return plain;
}

inline std::string suggestion(const std::string& word, const std::vector<std::string>& known) {
  const auto similar = rules::find_similar(word, {known.begin(), known.end()});
  return similar ? "; did you mean " + rules::quote(*similar) + '?' : "";
}

// Null: nothing is known of the option.
inline const Elsewhere* find_elsewhere(const std::string& verb, const std::string& option,
                                       const std::vector<Elsewhere>& elsewhere) {
  for (const Elsewhere& each : elsewhere) {
    const auto& options = each.options;
    if (each.verb != verb) continue;
    if (std::find(options.begin(), options.end(), option) != options.end()) return &each;
  }
  return nullptr;
}

// A line for each of these that the verb does not have, or for those with one hint.
inline std::vector<std::string> texts_of_options(const CLI::App& verb, const std::string& name,
                                                 const std::vector<std::string>& options,
                                                 const std::vector<Elsewhere>& elsewhere) {
  std::vector<std::string> lines;
  std::vector<const Elsewhere*> said;
  for (const std::string& option : options) {
    const Elsewhere* const known = find_elsewhere(name, option, elsewhere);
    if (known != nullptr && std::find(said.begin(), said.end(), known) != said.end()) continue;
    if (known != nullptr) said.push_back(known);
    lines.push_back(name + " has no option " + rules::quote(option) +
                    (known != nullptr ? "; " + std::string(known->hint)
                                      : suggestion(option, options_of(verb))));
  }
  return lines;
}

// Of options in front of the verb that has them: `arbiter --instance x status`; or that no verb
// has. Empty: there is none.
inline std::string text_of_early_options(const CLI::App& app, const Typed& typed,
                                         const std::vector<Elsewhere>& elsewhere) {
  const bool is_typed = typed.verb != &app;
  const std::vector<std::string> words = is_typed ? typed.before : app.remaining();
  const auto verbs = verbs_of(app);
  for (const std::string& option : options_in(words)) {
    if (has_option(app, option)) continue;
    const bool is_known =
        is_typed ? has_option(*typed.verb, option)
                 : std::any_of(verbs.begin(), verbs.end(),
                               [&](const CLI::App* each) { return has_option(*each, option); });
    if (!is_known && !is_typed) continue;
    if (!is_known) return texts_of_options(*typed.verb, typed.name, {option}, elsewhere).front();
    std::string line = is_typed ? typed.name : app.get_name() + " VERB";
    for (const std::string& each : words) line += ' ' + shell_word(each);
    const auto options = typed.verb->get_options();
    const bool has_others = std::any_of(options.begin(), options.end(),
                                        [](const CLI::Option* each) { return each->count() > 0; });
    return "the options of a verb go after it; write: " + line +
           (is_typed && has_others ? " ..." : "");
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
  const auto as = [](const std::string& option, const std::string& value) {
    return "; did you mean " + option + ' ' + shell_word(value) + '?';
  };
  const auto may_be = [&](const std::string& option) {
    return has_option(verb, option) && !is_given(verb, option);
  };
  const bool takes_others = takes_words(verb);
  std::string all;
  for (const std::string& word : words) {
    all += (all.empty() ? "" : " ") + word;
    if (word.ends_with(".xml") && has_option(verb, "--application-before"))
      return "; the files of one model are joined by commas, as in a.xml,b.xml";
    if (word.ends_with(".xml") && verb.get_name() == "reload")
      return "; it reads the files again that arbiterd was started with";
    if (word.ends_with(".mcap") && may_be("--recording")) return as("--recording", word);
    if (word.ends_with(".mcap") && missing == "--output") return as(missing, word);
    const bool has_rest = !takes_others || words.size() > 1;
    if (word.ends_with(".csv") && has_rest && may_be("--trace")) return as("--trace", word);
    // A model is a plain argument of some programs, and not of others.
    if (word.ends_with(".xml") && !takes_others && may_be("--model")) return as("--model", word);
  }
  const bool is_statement = all.find('/') != std::string::npos;
  return missing == "--until" && is_statement ? as(missing, all) : "";
}

inline std::string text_of_words(const CLI::App& verb, const std::string& name,
                                 const std::vector<std::string>& words) {
  std::vector<std::string> quoted;
  quoted.reserve(words.size());
  for (const std::string& word : words) quoted.push_back(rules::quote(word));
  return name + " has no place for " + rules::enumerate(quoted) + meant(verb, words, "");
}

// Of the verb that was typed last, which has none behind it.
inline bool lacks_verb(const CLI::App& typed) { return typed.get_require_subcommand_min() > 0; }

inline std::string text_of_missing_verb(const CLI::App& verb, const std::string& name) {
  std::vector<std::string> names;
  for (const CLI::App* each : verbs_of(verb)) names.push_back(each->get_name());
  const std::vector<std::string> words = words_in(verb.remaining());
  if (words.empty()) return name + " needs a verb: " + alternatives(names);
  return name + " has no verb " + rules::quote(words.front()) +
         rules::advise(words.front(), {names.begin(), names.end()},
                       "it has " + rules::enumerate(names));
}

// `missing`: as CLI11 says it, "--until is required".
inline std::string text_of_missing(const CLI::App& verb, const std::string& missing) {
  std::vector<std::string> words = words_in(verb.remaining());
  for (const CLI::Option* option : verb.get_options()) {
    if (!option->get_positional()) continue;
    const auto taken = option->results();
    words.insert(words.end(), taken.begin(), taken.end());
  }
  const std::string option = missing.substr(0, missing.find(' '));
  return missing + meant(verb, words, option.starts_with("--") ? option : "");
}

// What CLI11 says of values: "--silence: 1 required CODE missing", "--rate: At Most 1 required but
// received 2"; another text stays as it is.
inline std::string text_of_value(const std::string& text) {
  constexpr std::string_view kBefore = ": 1 required ";
  constexpr std::string_view kBehind = " missing";
  constexpr std::string_view kTooMany = ": At Most 1 required but received ";
  if (const std::size_t at = text.find(kTooMany); at != std::string::npos) {
    return text.substr(0, at) + " is given " + text.substr(at + kTooMany.size()) +
           " times; give it once";
  }
  const std::size_t at = text.find(kBefore);
  if (at == std::string::npos || !text.ends_with(kBehind)) return text;
  const std::string option = text.substr(0, at);
  const std::size_t begin = at + kBefore.size();
  return option + " needs a value; write: " + option + ' ' +
         text.substr(begin, text.size() - kBehind.size() - begin);
}

// As CLI11 says it, "Could not convert: --json = maybe": of numbers its checks have spoken before.
inline std::string text_of_flag_value(const std::string& text) {
  const std::size_t name = text.find(": ") + 2;
  const std::size_t value = text.find(" = ", name);
  if (value == std::string::npos) return text;
  return text.substr(name, value - name) + " takes no value; leave out " +
         rules::quote("=" + text.substr(value + 3));
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
  return "; for example: " + std::string(rules::trim(line.substr(0, line.find("  #"))));
}

inline std::string text_of(const CLI::Error& error, const Typed& typed,
                           const std::string& program) {
  const auto is = [&](CLI::ExitCodes code) {
    return error.get_exit_code() == static_cast<int>(code);
  };
  const CLI::App& verb = *typed.verb;
  std::string text = error.what();
  if (is(CLI::ExitCodes::ExtrasError) && !verb.remaining().empty()) {
    text = text_of_words(verb, typed.name, words_in(verb.remaining()));
  } else if (is(CLI::ExitCodes::ExtrasError) && !words_in(typed.before).empty()) {
    return text_of_words(verb, program, words_in(typed.before));
  } else if (is(CLI::ExitCodes::RequiredError)) {
    if (lacks_verb(verb)) return text_of_missing_verb(verb, typed.name);
    text = text_of_missing(verb, text);
  } else {
    return is(CLI::ExitCodes::ArgumentMismatch)  ? text_of_value(text)
           : is(CLI::ExitCodes::ConversionError) ? text_of_flag_value(text)
                                                 : text;
  }
  return text.ends_with('?') ? text : text + example_of(verb);
}

inline std::vector<std::string> lines_of(const CLI::App& app, const Typed& typed,
                                         const CLI::Error& error,
                                         const std::vector<Elsewhere>& elsewhere) {
  const std::string early = text_of_early_options(app, typed, elsewhere);
  if (!early.empty()) return {early};
  const auto left = typed.verb->remaining();
  if (typed.verb != &app && lacks_verb(*typed.verb) && !words_in(left).empty()) {
    return {text_of_missing_verb(*typed.verb, typed.name)};
  }
  // What stands behind an unknown option is probably its value, and what is missing may be meant by
  // it.
  std::vector<std::string> lines =
      texts_of_options(*typed.verb, typed.name, options_in(left), elsewhere);
  if (lines.empty()) lines.push_back(text_of(error, typed, app.get_name()));
  return lines;
}

}  // namespace wrong_use

// With its end of line, made printable: what was typed may hold anything. As
// CLI::App::failure_message() takes it.
[[nodiscard]] inline auto wrong_use_text_with(std::vector<Elsewhere> elsewhere) {
  return [elsewhere = std::move(elsewhere)](const CLI::App* app, const CLI::Error& error) {
    const wrong_use::Typed typed = wrong_use::typed_verb(*app);
    std::string text;
    for (const std::string& line : wrong_use::lines_of(*app, typed, error, elsewhere)) {
      text += shm::printable(line) + '\n';
    }
    return text + "Run `" + typed.name + " --help` for more information.\n";
  };
}
[[nodiscard]] inline std::string wrong_use_text(const CLI::App* app, const CLI::Error& error) {
  return wrong_use_text_with({})(app, error);
}

}  // namespace arbiter::command_line
