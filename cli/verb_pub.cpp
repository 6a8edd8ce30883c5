// arbiter pub: publishes on an output port, to try things out.
#include <chrono>
#include <cstdint>
#include <exception>
#include <iostream>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

#include "cli/live.hpp"
#include "cli/numbers.hpp"
#include "cli/port_name.hpp"
#include "cli/pub_payload.hpp"
#include "cli/pub_takers.hpp"
#include "cli/pub_type.hpp"
#include "cli/verbs.hpp"
#include "rules/text/names.hpp"
#include "shm/clock.hpp"
#include "shm/utf8.hpp"

namespace arbiter::cli {
namespace {

struct PubOptions {
  std::string port;
  std::string instance;
  double rate_hz = 1;
  std::uint64_t count = 0;  // 0: until interrupted
  PayloadOptions payload;
  std::string type;  // with `like` empty: untyped
  std::string like;
  bool strict = false;
  bool quiet = false;
  PubCommand command;
};

// What an untyped sample has where nothing else is said.
constexpr std::size_t kDefaultSize = 8;

Type type_of(const PubOptions& options, std::size_t untyped_size) {
  if (!options.type.empty()) return parse_type(options.type);
  if (options.like.empty()) return Type::untyped(untyped_size);
  return type_like(fetch_status("pub-like", options.instance), options.like);
}

OutputPort<void> open(Node& node, const PubOptions& options, const Type& type) {
  if (!type.is_untyped()) return node.output_port(options.port, type);
  OutputPortOptions port_options;
  port_options.max_size = type.size();
  return node.output_port(options.port, port_options);
}

void report(const std::string& message) {
  std::cerr << "arbiter: " << shm::printable(message) << '\n';
}

// Waits until those on other hosts who want the source have it, or it is plain that they do not get
// it: of a port that closes before, they would never hear. Where one does not answer at once,
// nobody is waited for: what is published here may be urgent.
TakersElsewhere await_elsewhere(const PubOptions& options, const Type& type,
                                const shm::FileDescriptor& interrupts) {
  constexpr shm::Nanoseconds kLongest = 3'000'000'000;
  constexpr shm::Nanoseconds kLookAgain = 50'000'000;
  constexpr std::chrono::milliseconds kBriefPatience{300};
  const shm::Nanoseconds until = shm::monotonic_now() + kLongest;
  for (;;) {
    TakersElsewhere found = find_elsewhere(
        statuses_of_other_hosts(options.instance, kBriefPatience), options.port, type);
    if (!found.is_any()) return found;
    const shm::Nanoseconds now = shm::monotonic_now();
    found.is_imported =
        found.is_imported &&
        is_sent_to_others(fetch_status("pub-status", options.instance), options.port);
    if (found.is_imported || now >= until || sleep_until(now + kLookAgain, interrupts))
      return found;
  }
}

// Says what keeps samples from being taken. False: nobody can take any.
bool check_takers(const PubOptions& options, const Type& type,
                  const shm::FileDescriptor& interrupts) try {
  TakersElsewhere elsewhere = await_elsewhere(options, type, interrupts);
  if (!elsewhere.is_imported) {
    report("other hosts want " + options.port +
           ", and have not opened it within 3 s: what is published before they do, they never get");
    elsewhere = {};
  }
  const Takers takers = find_takers(fetch_status("pub-status", options.instance), options.port,
                                    type, options.command, elsewhere);
  for (const std::string& message : takers.messages) report(message);
  if (const std::string text = elsewhere.text(options.port); !text.empty()) report(text);
  return takers.is_any;
} catch (const std::exception& error) {
  // It is not allowed, or the daemon has gone meanwhile: that is no reason not to publish, unless
  // the user wants to be sure.
  if (options.strict) {
    std::cerr << "arbiter: who can take the samples is not known: " << shm::printable(error.what())
              << '\n';
  }
  return false;
}

int publish(const PubOptions& options, OutputPort<void>& out, const std::vector<std::byte>& payload,
            const shm::FileDescriptor& interrupts) {
  constexpr shm::Nanoseconds kMostBehind = 1'000'000'000;
  const auto period = static_cast<shm::Nanoseconds>(1e9 / options.rate_hz);
  shm::Nanoseconds next = shm::monotonic_now();
  std::uint64_t published = 0;
  std::uint64_t delivered = 0;
  std::uint64_t discarded = 0;
  std::uint64_t refused = 0;
  while (options.count == 0 || published < options.count) {
    if (sleep_until(next, interrupts)) break;
    const Outcome outcome = out.publish(Bytes(payload.data(), payload.size()));
    ++published;
    delivered += outcome.delivered;
    discarded += outcome.discarded;
    refused += outcome.refused;
    if (!options.quiet) {
      std::cout << '#' << published << "  delivered " << outcome.delivered << "  discarded "
                << outcome.discarded << "  refused " << outcome.refused << std::endl;
      if (!std::cout) break;
    }
    next += period;
    // Who was stopped, or slept with the machine, does not publish all that it has missed at once.
    const shm::Nanoseconds now = shm::monotonic_now();
    if (now - next > kMostBehind) next = now;
  }
  std::cout << "published " << rules::counted(published, "sample") << " of "
            << rules::counted(payload.size(), "byte") << ": delivered " << delivered
            << ", discarded " << discarded << ", refused " << refused << '\n';
  return 0;
}

int pub(PubOptions& options) {
  // All that may fail, or block for ever, comes before the port opens, and before Ctrl-C is only
  // heard by the loop: standard input may never end.
  auto given = read_payload(options.payload);
  const Type type = type_of(options, given ? given->size() : kDefaultSize);
  const auto payload = payload_of(std::move(given), options.payload, type);
  options.command.payload_size = payload.size();
  const auto interrupts = catch_interrupts();
  Node node("arbiter-pub", live_options(options.instance));
  auto out = open(node, options, type);
  if (!check_takers(options, type, interrupts) && options.strict) {
    std::cerr << "arbiter: nobody can take what " << options.port
              << " sends, so nothing was published (--strict)\n";
    return 1;
  }
  return publish(options, out, payload, interrupts);
}

// As the user has typed it, to advise another.
PubCommand command_of(const CLI::App& verb) {
  PubCommand command;
  for (const CLI::Option* option : verb.parse_order()) {
    const bool is_flag = option->get_items_expected_max() == 0;
    const std::string name = option->nonpositional() ? option->get_name() : "";
    command.arguments.emplace_back(name, is_flag ? "" : option->as<std::string>());
    command.has_type |= name == "--type" || name == "--like";
  }
  return command;
}

void add_payload_options(CLI::App& verb, PayloadOptions& payload) {
  auto* size = verb.add_option("--size", payload.size,
                               "Bytes of a sample, zeroed (default: as the type has, untyped 8)")
                   ->type_name("BYTES")
                   ->check(whole_number_between(0, kMaxPayload));
  auto* text = verb.add_option("--text", payload.text, "The sample, as text")
                   ->type_name("TEXT")
                   ->excludes(size);
  auto* hex = verb.add_option("--hex", payload.hex,
                              "The sample, two hexadecimal digits for each byte; blanks between "
                              "them are passed over")
                  ->type_name("0A0B")
                  ->excludes(size)
                  ->excludes(text);
  verb.add_option("--file", payload.file,
                  "The sample: all of a file, at most 1 GiB; - is standard input")
      ->type_name("FILE")
      ->excludes(size)
      ->excludes(text)
      ->excludes(hex);
}

}  // namespace

void add_pub(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<PubOptions>();
  CLI::App* verb = app.add_subcommand("pub", "Publish on an output port");
  verb->add_option("PORT", options->port, "The output port's name")
      ->required()
      ->check(name_of_port());
  verb->add_option("--rate", options->rate_hz, "Samples in a second (default 1)")
      ->type_name("HZ")
      ->check(number_between(1e-3, 1e6));
  verb->add_option("--count", options->count, "How many samples (default: until interrupted)")
      ->type_name("N")
      ->check(at_least_one());
  add_payload_options(*verb, options->payload);
  auto* type = verb->add_option("--type", options->type,
                                "The samples' type, for input ports that take no other: its name, "
                                "which may have colons, the bytes of a sample, and its alignment")
                   ->type_name(kTypeForm);
  verb->add_option("--like", options->like,
                   "The samples' type is that of this input or output port, which a component "
                   "must have open; of a source that nobody has open, that of its input ports")
      ->type_name("PORT")
      ->excludes(type);
  verb->add_flag(
      "--strict", options->strict,
      "Publish nothing, and end with 1, unless somebody can take the samples when it starts");
  verb->add_flag("--quiet", options->quiet, "Print the summary only");
  add_instance_option(*verb, options->instance);
  verb->footer(R"(Examples:
  arbiter pub /Face/pos:o --rate 10 --count 50 --text hello
  arbiter pub /Joystick/cmd:o --like /Base/cmd:i --file twist.bin
  arbiter pub /Number:o --type arbiter::test::Number:8:8 --hex "0100 0000 0000 0000" --count 1

Standard error says at once if nobody can take the samples: no component has an input port open that
the model connects to PORT, the types differ or the connection is refused for another reason, or the
model does not mention PORT. Without --strict they are published all the same: they make the source
active, and somebody may come who takes them. Where arbiter-link runs, it says which ports of other
hosts take them, and waits until they can, for 3 s at most.

Exit codes: 0 published, whoever took it; 1 no daemon, a port that cannot be opened, no type for
--like, or with --strict nobody who can take it; 2 wrong use, a payload that does not fit the type,
or a file that cannot be read)");
  verb->callback([options, verb, &exit_code] {
    options->command = command_of(*verb);
    exit_code = pub(*options);
  });
}

}  // namespace arbiter::cli
