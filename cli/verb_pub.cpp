// arbiter pub: publishes on an output port, to try things out.
#include <cstdint>
#include <exception>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "cli/live.hpp"
#include "cli/numbers.hpp"
#include "cli/verbs.hpp"
#include "rules/text/names.hpp"
#include "shm/clock.hpp"

namespace arbiter::cli {
namespace {

struct PubOptions {
  std::string port;
  std::string instance;
  double rate_hz = 1;
  std::uint64_t count = 0;  // 0: until interrupted
  std::size_t size = 8;
  std::string text;
  std::string type;  // empty: untyped
  std::size_t alignment = 8;
  bool quiet = false;
};

std::vector<std::byte> payload_of(const PubOptions& options) {
  if (options.text.empty()) return std::vector<std::byte>(options.size);
  const auto* bytes = reinterpret_cast<const std::byte*>(options.text.data());
  return {bytes, bytes + options.text.size()};
}

// Of ports that do not fit, or of which the model knows nothing, there was a notice. Says nothing
// where the source is only sensed, or the daemon does not let us observe.
void warn_if_nobody_is_there(const PubOptions& options) try {
  const auto status = fetch_status("pub-status", options.instance);
  std::vector<std::string> missing;
  for (const auto& input : status.inputs) {
    for (const auto& connection : input.connections) {
      if (connection.source != options.port) continue;
      if (connection.is_connected()) return;
      if (!input.open) missing.push_back(input.name);
    }
  }
  if (missing.empty()) return;
  std::cerr << "arbiter: no component has " << rules::enumerate(missing)
            << " open, which the model connects to " << options.port
            << ", so none of these samples is delivered\n";
} catch (const std::exception&) {
  // It is not allowed, or the daemon has gone meanwhile: that is no reason not to publish.
}

int pub(const PubOptions& options) {
  const auto interrupts = catch_interrupts();
  const std::vector<std::byte> payload = payload_of(options);
  Node node("arbiter-pub", live_options(options.instance));
  OutputPortOptions port_options;
  port_options.max_size = payload.size();
  auto out =
      options.type.empty()
          ? node.output_port(options.port, port_options)
          : node.output_port(options.port, Type(options.type, payload.size(), options.alignment));
  warn_if_nobody_is_there(options);
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
  }
  std::cout << "published " << published << " samples of " << payload.size() << " bytes: delivered "
            << delivered << ", discarded " << discarded << ", refused " << refused << '\n';
  return 0;
}

}  // namespace

void add_pub(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<PubOptions>();
  CLI::App* verb = app.add_subcommand("pub", "Publish on an output port");
  verb->add_option("PORT", options->port, "The output port's name")->required();
  verb->add_option("--rate", options->rate_hz, "Samples in a second (default 1)")
      ->type_name("HZ")
      ->check(CLI::Range(1e-3, 1e6));
  verb->add_option("--count", options->count, "How many samples (default: until interrupted)")
      ->type_name("N")
      ->check(at_least_one());
  auto* size = verb->add_option("--size", options->size, "Bytes of a sample (default 8), zeroed")
                   ->type_name("BYTES")
                   ->check(CLI::Range(std::size_t{0}, std::size_t{1} << 32));
  verb->add_option("--text", options->text, "The sample, as text")->excludes(size);
  auto* type = verb->add_option("--type", options->type,
                                "The type's name, for input ports that take no other")
                   ->type_name("NAME");
  verb->add_option("--alignment", options->alignment, "The type's alignment (default 8)")
      ->type_name("BYTES")
      ->needs(type);
  verb->add_flag("--quiet", options->quiet, "Print the summary only");
  add_instance_option(*verb, options->instance);
  verb->footer(
      "Examples:\n  arbiter pub /Face/pos:o --rate 10 --count 50 --text hello\n"
      "  arbiter pub /Joystick/cmd:o --type geometry/Twist --size 48");
  verb->callback([options, &exit_code] { exit_code = pub(*options); });
}

}  // namespace arbiter::cli
