// An input port that is opened: what its arbiter lets through.
#include <cstdint>
#include <exception>
#include <iostream>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include <nlohmann/json.hpp>

#include "cli/echo.hpp"
#include "cli/echo_hosts.hpp"
#include "cli/live.hpp"
#include "rules/text/names.hpp"
#include "shm/clock.hpp"

namespace arbiter::cli {
namespace {

constexpr std::uint32_t kDepth = 1024;

class Echo {
 public:
  Echo(const EchoOptions& options, EchoNews& news, const shm::FileDescriptor& interrupts)
      : options_(options), news_(news), interrupts_(interrupts), started_(shm::monotonic_now()) {
    open();
  }

  int run() {
    echo_while(
        options_, [this] { return in_->fd(); }, interrupts_, news_, [this] { return look(); });
    return finish();
  }

 private:
  Looked look() {
    for (int i = 0; i < kMostOfLook; ++i) {
      const auto sample = in_->take();
      if (!sample) {
        open_beside_other_memory();
        return Looked::kNothing;
      }
      print(*sample);
      if (++samples_ == options_.count || !std::cout) return Looked::kEnough;
    }
    return Looked::kMore;
  }

  void open() {
    InputPortOptions options;
    options.keep = true;
    options.depth = kDepth;
    node_.emplace("arbiter-echo", echo_node_options(options_));
    in_.emplace(node_->input_port(options_.port, options));
    if (news_.instance() != nullptr) memory_ = news_.instance()->memory();
  }

  // A daemon that came without the memory of the last one does not take back a node that has ports.
  void open_beside_other_memory() {
    if (news_.instance() == nullptr || news_.instance()->memory() == memory_) return;
    std::cerr << "arbiter: it came without the memory of the last one; arbiter opens "
              << options_.port << " again\n";
    in_.reset();
    node_.reset();
    open();
  }

  void print(const Sample<void>& sample) {
    ++by_source_[sample.source()];
    if (options_.json) {
      nlohmann::json line{{"port", options_.port},
                          {"source", sample.source()},
                          {"sequence", sample.sequence()},
                          {"stamp_ns", sample.stamp_ns()},
                          {"size", sample.size()}};
      if (sample.origin().publisher != 0) {
        line["origin"] = hosts_.json_of(std::string(sample.source()), sample.origin());
      }
      std::cout << line.dump() << '\n';
      return;
    }
    std::cout << seconds_text(sample.stamp_ns() - started_) << "  " << sample.source() << "  #"
              << sample.sequence() << hosts_.text(std::string(sample.source()), sample.origin())
              << "  " << rules::counted(sample.size(), "byte");
    if (options_.hex) {
      std::cout << '\n' << hex_dump(*sample);
    } else {
      std::cout << "  " << preview(*sample) << '\n';
    }
  }

  // On standard error beside JSON, which is for programs.
  int finish() {
    if (!std::cout) return 0;  // nobody reads it
    std::ostream& out = options_.json ? std::cerr : std::cout;
    out << rules::counted(samples_, "sample") << " in "
        << seconds_text(shm::monotonic_now() - started_);
    for (const auto& [source, count] : by_source_) out << ", " << count << " from " << source;
    out << '\n';
    if (const auto lost = overtaken(); lost != 0) {
      std::cerr << "arbiter: " << lost << " more came faster than they could be printed\n";
    }
    return 0;
  }

  [[nodiscard]] std::uint64_t overtaken() const try {
    watch::Instance* const instance = news_.instance();
    if (instance == nullptr || !instance->has_daemon()) return 0;
    const auto status = instance->status();
    const auto* input = status.find_input(options_.port);
    return input == nullptr || !input->open ? 0 : input->open->overtaken;
  } catch (const std::exception&) {
    return 0;  // the daemon has gone meanwhile
  }

  const EchoOptions& options_;
  EchoNews& news_;
  const shm::FileDescriptor& interrupts_;
  EchoHosts hosts_{options_.instance};
  std::shared_ptr<const shm::DecisionMemory> memory_;  // by which the port is open
  std::optional<Node> node_;
  std::optional<InputPort<void>> in_;
  const shm::Nanoseconds started_;
  std::uint64_t samples_ = 0;
  std::map<std::string, std::uint64_t> by_source_;
};

}  // namespace

namespace {

// Opened as an input port, the name of an output port would be another port, which nobody feeds.
void refuse_output_port(const EchoOptions& options, watch::Instance* instance) {
  if (instance == nullptr) return;  // the policy does not let us ask
  wire::Status status;
  try {
    status = instance->status();
  } catch (const std::exception&) {
    return;  // opening the port will say what is wrong
  }
  const auto* source = status.find_source(options.port);
  if (source == nullptr || status.find_input(options.port) != nullptr) return;
  if (!source->open && !source->mentioned) return;  // a name of the past
  throw Error(options.port + " is an output port of " +
              (source->open ? source->open->component.node : "the model in force") +
              "; --as-component takes an input port. To watch it, leave out --as-component");
}

}  // namespace

int echo_component(const EchoOptions& options, const shm::FileDescriptor& interrupts) {
  EchoNews news(options.instance, options.port, interrupts);
  refuse_output_port(options, news.instance());
  return Echo(options, news, interrupts).run();
}

}  // namespace arbiter::cli
