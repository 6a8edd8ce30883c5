// arbiter: the tool on the command line.
#include <algorithm>
#include <array>
#include <csignal>
#include <exception>
#include <iostream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

#include "cli/broken_pipe.hpp"
#include "cli/verbs.hpp"
#include "command_line/standard_streams.hpp"
#include "command_line/values.hpp"
#include "command_line/wrong_use.hpp"
#include "recording/mcap.hpp"
#include "rules/model/load.hpp"
#include "rules/text/names.hpp"
#include "shm/utf8.hpp"

namespace {

constexpr int kFailed = 1;
constexpr int kWrongUse = 2;

// What was typed may hold anything; on a terminal, control characters would be obeyed.
void say(const std::string& what) {
  std::cerr << "arbiter: " << arbiter::shm::printable(what, "\n\t") << '\n';
}

// What other programs call a verb; empty: none.
std::string_view verb_for(std::string_view word) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 11> kMeant{{
      {"explain", "why"},
      {"validate", "check"},
      {"watch", "top"},
      {"monitor", "top"},
      {"tail", "echo"},
      {"hz", "echo --rate"},
      {"list", "status"},
      {"ls", "status"},
      {"info", "status"},
      {"models", "switch"},
      {"draw", "graph"},
  }};
  const auto* const found = std::find_if(kMeant.begin(), kMeant.end(),
                                         [&](const auto& each) { return each.first == word; });
  return found == kMeant.end() ? std::string_view() : found->second;
}

// What a verb has no option for, and another verb does.
std::vector<arbiter::command_line::Elsewhere> options_elsewhere() {
  return {{"arbiter why",
           {"--at", "--recording"},
           "it asks a running daemon; of what was recorded, ask: "
           "arbiter simulate --recording FILE --why=PORT --at TIME"}};
}

// CLI11 would say that a verb is missing.
bool knows_verb(const CLI::App& app, const std::string& word) {
  if (word.empty() || word.front() == '-') return true;
  std::vector<std::string> names;
  for (const CLI::App* verb : app.get_subcommands([](const CLI::App*) { return true; })) {
    names.push_back(verb->get_name());
  }
  if (std::find(names.begin(), names.end(), word) != names.end()) return true;
  const std::vector<std::string_view> known(names.begin(), names.end());
  if (const std::string_view meant = verb_for(word); !meant.empty()) {
    say("there is no verb " + arbiter::rules::quote(word) + "; did you mean " +
        arbiter::rules::quote(meant) + "?");
    return false;
  }
  say("there is no verb " + arbiter::rules::quote(word) +
      arbiter::rules::advise(word, known, "`arbiter --help` lists them"));
  return false;
}

// Those of each verb that does not list its own.
void add_exit_codes(CLI::App& app) {
  for (CLI::App* verb : app.get_subcommands({})) {
    const std::string footer = verb->get_footer();
    if (footer.find("Exit codes:") != std::string::npos) continue;
    const bool asks_daemon = verb->get_option_no_throw("--instance") != nullptr;
    verb->footer(footer + "\n\nExit codes: 0 done; 1 an error in what you asked about" +
                 (asks_daemon ? ", or no daemon; 2 wrong use, or a file\nthat"
                              : "; 2 wrong use, or a file that") +
                 " cannot be opened or written");
  }
}

// `arbiter help VERB` as well as `arbiter VERB --help`.
std::vector<std::string> words_of(int argc, char** argv) {
  std::vector<std::string> words(argv + std::min(argc, 1), argv + argc);
  if (words.empty()) return words;
  if (words.front() == "diff") {
    for (std::string& word : words) {  // "-,b.xml" is an option to CLI11
      if (word.starts_with("-,")) word.replace(0, 1, "/dev/stdin");
    }
  }
  if (words.front() != "help") return words;
  words.erase(words.begin());
  words.emplace_back("--help");
  return words;
}

int run(int argc, char** argv) {
  CLI::App app(
      "Port arbitration for robot components: at each input port, at most one connection wins.",
      "arbiter");
  app.set_version_flag("--version", "arbiter " ARBITER_VERSION);
  app.require_subcommand(1);
  app.footer(
      "Examples:\n"
      "  arbiter check search_and_track.xml\n"
      "  arbiter why /Arm/pos:i\n"
      "  arbiter help why\n\n"
      "Exit codes: 0 done; 1 an error in what you asked about, or no daemon; 2 wrong use, or a "
      "file\n"
      "that cannot be opened or written. Each verb's help has its own.");
  int exit_code = 0;
  arbiter::cli::add_check(app, exit_code);
  arbiter::cli::add_diff(app, exit_code);
  arbiter::cli::add_rules(app, exit_code);
  arbiter::cli::add_graph(app, exit_code);
  arbiter::cli::add_compile(app, exit_code);
  arbiter::cli::add_import(app, exit_code);
  arbiter::cli::add_simulate(app, exit_code);
  arbiter::cli::add_play(app, exit_code);
  arbiter::cli::add_echo(app, exit_code);
  arbiter::cli::add_pub(app, exit_code);
  arbiter::cli::add_record(app, exit_code);
  arbiter::cli::add_replay(app, exit_code);
  arbiter::cli::add_recording(app, exit_code);
  arbiter::cli::add_status(app, exit_code);
  arbiter::cli::add_hosts(app, exit_code);
  arbiter::cli::add_top(app, exit_code);
  arbiter::cli::add_why(app, exit_code);
  arbiter::cli::add_wait(app, exit_code);
  arbiter::cli::add_winners(app, exit_code);
  arbiter::cli::add_metrics(app, exit_code);
  arbiter::cli::add_doctor(app, exit_code);
  arbiter::cli::add_deactivate(app, exit_code);
  arbiter::cli::add_reload(app, exit_code);
  arbiter::cli::add_switch(app, exit_code);
  arbiter::cli::add_rollback(app, exit_code);
  arbiter::cli::add_history(app, exit_code);
  arbiter::cli::add_stop(app, exit_code);
  add_exit_codes(app);
  arbiter::command_line::refuse_empty(app, {"--text", "--hex"});  // a sample of no bytes
  app.failure_message(arbiter::command_line::wrong_use_text_with(options_elsewhere()));
  std::vector<std::string> words = words_of(argc, argv);
  if (!words.empty() && !knows_verb(app, words.front())) return kWrongUse;
  std::reverse(words.begin(), words.end());  // as CLI11 wants them
  try {
    app.parse(std::move(words));  // runs the verb
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kWrongUse;  // --help and --version come this way as well
  } catch (const arbiter::rules::FileError& error) {
    say(error.what());
    return kWrongUse;
  } catch (const arbiter::recording::McapError& error) {
    say(error.what());
    return kWrongUse;
  } catch (const std::invalid_argument& error) {  // $ARBITER_INSTANCE is no name for an instance
    say(error.what());
    return kWrongUse;
  }
  return exit_code;
}

}  // namespace

int main(int argc, char** argv) {
  if (!arbiter::command_line::open_standard_streams()) return kFailed;
  std::signal(SIGPIPE, SIG_IGN);  // bells of receivers that have died (cli/broken_pipe.hpp)
  std::signal(SIGXFSZ, SIG_IGN);  // and so is a limit to the size of files
  std::ios::sync_with_stdio(false);
  int exit_code = kFailed;
  try {
    exit_code = run(argc, argv);
  } catch (const std::exception& error) {
    say(error.what());
  }
  if (!std::cout.flush()) {
    if (arbiter::cli::has_reader_gone()) arbiter::cli::end_by_broken_pipe();
    std::cerr << "arbiter: cannot write to standard output\n";
    return kWrongUse;  // whatever it was: 1 would be an answer, such as diff's
  }
  return exit_code;
}
