// arbiter metrics: what the status document counts, for Prometheus.
#include <chrono>
#include <exception>
#include <functional>
#include <iostream>
#include <memory>
#include <string>
#include <utility>

#include <CLI/CLI.hpp>

#include "cli/live.hpp"
#include "cli/metrics_server.hpp"
#include "cli/verbs.hpp"
#include "shm/utf8.hpp"
#include "watch/metrics.hpp"

namespace arbiter::cli {
namespace {

// A collector of metrics waits no longer than this; meanwhile --listen serves nobody else.
constexpr std::chrono::milliseconds kScrapeTime{1000};

struct MetricsOptions {
  std::string instance;
  ListenAddress address;
};

int write_once(const MetricsOptions& options) {
  wire::Status status;
  try {
    wire::Caller who = caller("metrics", options.instance);
    who.answer_time = kScrapeTime;
    status = fetch_status(std::move(who), kScrapeTime);
  } catch (const std::exception&) {
    std::cout << watch::metrics_of_no_daemon();
    throw;
  }
  std::cout << watch::metrics_of(status);
  return 0;
}

// The daemon may come and go.
class Source {
 public:
  explicit Source(const std::string& instance) : caller_(caller("metrics", instance)) {
    caller_.patience = std::chrono::milliseconds(10);
    caller_.answer_time = kScrapeTime;
    caller_.on_waiting = {};
  }

  std::string operator()() {
    try {
      std::string text = watch::metrics_of(fetch_status(caller_, kScrapeTime));
      if (!std::exchange(said_, {}).empty()) std::cerr << "arbiter: the daemon answers again\n";
      return text;
    } catch (const std::exception& error) {
      if (std::exchange(said_, error.what()) != error.what()) {
        std::cerr << "arbiter: " << shm::printable(error.what(), "\n\t") << '\n';
      }
      return watch::metrics_of_no_daemon();
    }
  }

 private:
  wire::Caller caller_;
  std::string said_;
};

int serve(const MetricsOptions& options) {
  const shm::FileDescriptor interrupts = catch_interrupts();
  MetricsServer server(options.address, Source(options.instance));
  std::cerr << "arbiter: serving " << server.url()
            << (server.url().starts_with("http") ? "/metrics\n" : ", path /metrics\n");
  server.run(interrupts);
  return 0;
}

}  // namespace

void add_metrics(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<MetricsOptions>();
  CLI::App* verb = app.add_subcommand(
      "metrics", "Write counters and states in Prometheus's text format, or serve them over HTTP");
  auto* listen = verb->add_option("--listen", options->address.text,
                                  "Serve them until interrupted: ADDRESS:PORT, or a socket's path, "
                                  "which has a '/' in it or ends in .sock")
                     ->type_name("ADDRESS");
  verb->add_flag("--allow-remote", options->address.allow_remote,
                 "With --listen: also on an address that other machines can reach")
      ->needs(listen);
  add_instance_option(*verb, options->instance);
  verb->footer(
      "Examples:\n"
      "  arbiter metrics\n"
      "  arbiter metrics --listen 127.0.0.1:9180     # then scrape "
      "http://127.0.0.1:9180/metrics\n\n"
      "Without a daemon, or if it does not answer within a second, the only metric is arbiter_up "
      "0.\n\n"
      "Exit codes: 0 written, or served until interrupted; 1 no daemon, or you may not observe; "
      "or\n"
      "the address cannot be listened on; 2 wrong use, or standard output cannot be written");
  verb->callback([options, &exit_code] {
    exit_code = options->address.text.empty() ? write_once(*options) : serve(*options);
  });
}

}  // namespace arbiter::cli
