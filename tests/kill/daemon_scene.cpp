#include "tests/kill/daemon_scene.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/stat.h>

#include <utility>

#include "tests/client/models.hpp"

namespace arbiter::test {
namespace {

std::string model_of(const std::string& source) {
  return rules(arbiter_at("/in", select("/" + source)) +
               arbiter_at("/fresh:i", select("/fresh:o")) + arbiter_at("/late:i", select("/side")) +
               arbiter_at("/again:i", select("/again:o")));
}

Daemon::Options daemon_options(bool stores) {
  Daemon::Options options;
  options.program = ARBITER_DAEMON_VICTIM;
  if (stores) options.arguments = {"--descriptor-store"};
  return options;
}

// A component that runs as another user.
std::vector<std::string> by_stranger() {
  return {"/bin/sh", "-c", R"(exec setpriv --reuid=54321 --regid=54321 --clear-groups "$0" "$@")"};
}

}  // namespace

DaemonScene::DaemonScene(const Options& options)
    : options_(options),
      die_at_("ARBITER_DIE_AT", files_.write("die-at", "")),
      daemon_(model_of("a"), daemon_options(options.stores)) {
  if (options_.by_stranger && ::chmod(daemon_.directory().c_str(), 0711) != 0) {
    throw std::runtime_error("chmod");
  }
  if (options_.has_survivors) open_survivors();
}

void DaemonScene::open_survivors() {
  NodeOptions options;
  options.on_notice = [this](const Notice& notice) {
    if (notice.kind == NoticeKind::asked_to_yield) yielding_.reset();
  };
  node_.emplace("survivor", options);
  for (const char* name : {"/a", "/b"}) {
    outputs_.emplace(name, node_->output_port<Number>(name));
  }
  side_.emplace(node_->output_port<Number>("/side"));
  in_.emplace(node_->input_port<Number>("/in"));
  fresh_.emplace(node_->input_port<Number>("/fresh:i"));
  if (options_.yields) {
    OutputPortOptions yields;
    yields.yields = true;
    yielding_.emplace(node_->output_port<Number>("/fresh:o", yields));
  }
  if (options_.by_stranger) {
    // So that it passes to another user.
    static_cast<void>(node_->output_port<Number>("/fresh:o"));
    asking_.emplace("asking", by_stranger());
  } else {
    asking_.emplace("asking");
  }
}

void DaemonScene::die_at(const std::string& step, unsigned passing) {
  files_.write("die-at", step + " " + std::to_string(passing));
}

// True: by its own hand.
bool DaemonScene::has_died() {
  EXPECT_EQ(daemon_.process().wait(), 128 + SIGKILL) << log();
  return true;
}

bool DaemonScene::lives() {
  try {
    static_cast<void>(daemon_.status());
    return true;
  } catch (const std::exception&) {
    return !has_died();
  }
}

bool DaemonScene::start() {
  EXPECT_EQ(daemon_.terminate(), 0);
  try {
    daemon_.restart();
  } catch (const std::exception&) {
    return !has_died();
  }
  return lives();
}

bool DaemonScene::take_over() {
  daemon_.kill();
  try {
    daemon_.restart();
  } catch (const std::exception&) {
    return !has_died();
  }
  return lives();
}

bool DaemonScene::stop() {
  daemon_.process().signal(SIGTERM);
  const int how = daemon_.process().wait();
  if (how == 0) daemon_.restart();
  return how == 0;
}

bool DaemonScene::reload() {
  in_force_ = "b";
  daemon_.write_model(model_of(in_force_));
  try {
    RawClient client(daemon_.instance());
    client.hello("reload");
    client.send(RawClient::message(wire::MessageKind::kReload));
    client.expect(wire::MessageKind::kDone);
  } catch (const std::exception&) {
    return !has_died();
  }
  return lives();
}

bool DaemonScene::ask(const std::vector<std::string>& lines) {
  for (const std::string& line : lines) {
    const auto name = line.find(' ') + 1;
    asked_for_[line.substr(name)] = line.rfind("close", 0) != 0;
  }
  for (auto line = lines.begin(); line != lines.end();) {
    asking_->begin(*line);
    pollfd polled[2] = {{daemon_.process().descriptor(), POLLIN, 0},
                        {asking_->descriptor(), POLLIN, 0}};
    while (::poll(polled, 2, -1) < 0) {
    }
    if (polled[0].revents != 0) {
      unanswered_.assign(line, lines.end());
      return !has_died();
    }
    const std::string answer = asking_->answer();
    if (is_refused_for_now(answer)) continue;
    EXPECT_THAT(answer, testing::AnyOf("open", "closed")) << *line;
    ++line;
  }
  return lives();
}

// On a busy machine the one that yields may take longer than the daemon waits for it.
bool DaemonScene::is_refused_for_now(const std::string& answer) const {
  return options_.yields && answer.find("is held by") != std::string::npos;
}

void DaemonScene::finish_asking() {
  bool has_begun = true;
  for (const std::string& line : std::exchange(unanswered_, {})) {
    if (!has_begun) asking_->begin(line);
    has_begun = false;
    std::string answer = asking_->answer();
    while (is_refused_for_now(answer)) answer = asking_->tell(line);
    EXPECT_THAT(answer, testing::AnyOf("open", "closed")) << line;
  }
}

// One of the two is let through, whichever model is in force.
void DaemonScene::require_flow() {
  if (!node_) return;
  std::uint64_t delivered = 0;
  for (auto& [name, port] : outputs_) {
    const bool gets_through = port.publish(Number{++next_}).delivered == 1;
    if (!gets_through) continue;
    ++delivered;
    EXPECT_EQ(take_from(*in_), next_) << name;
  }
  EXPECT_EQ(delivered, 1u);
  EXPECT_EQ(take_from(*in_), kNothing);
}

void DaemonScene::restart() {
  live_on();
  if (options_.stores) {
    daemon_.restart_with_stored();
  } else {
    daemon_.restart();
  }
}

// Its swap may not be over when the daemon is ready.
void DaemonScene::require_model_in_force() {
  for (int tries = 0; tries < 10000; ++tries) {
    for (auto& [name, port] : outputs_) {
      const bool gets_through = port.publish(Number{++next_}).delivered == 1;
      while (in_->take()) {
      }
      if (gets_through && name == "/" + in_force_) return;
    }
    static_cast<void>(daemon_.status());
  }
  ADD_FAILURE() << "the model of /" << in_force_ << " is not in force\n" << log();
}

void DaemonScene::require_one_writer() {
  Node rival("rival");
  for (const auto& [name, port] : outputs_) {
    EXPECT_THROW(static_cast<void>(rival.output_port<Number>(name)), Error) << name;
  }
  for (const auto& [name, is_open] : asked_for_) {
    const bool is_output = name.back() == 'o';
    try {
      if (is_output) {
        static_cast<void>(rival.output_port<Number>(name));
      } else {
        static_cast<void>(rival.input_port<Number>(name));
      }
      EXPECT_FALSE(is_open) << name << " has two owners";
    } catch (const Error& error) {
      EXPECT_TRUE(is_open) << error.what();
      EXPECT_THAT(error.what(), testing::HasSubstr("is held by"));
    }
  }
  if (const auto fresh = asked_for_.find("/fresh:o"); fresh != asked_for_.end() && fresh->second) {
    EXPECT_EQ(asking_->tell("publish /fresh:o 7"), "1 0 0");
    EXPECT_EQ(take_from(*fresh_), 7);
  }
}

void DaemonScene::require_accounts_balance() {
  const auto status = daemon_.status();
  for (const auto& input : status["inputs"]) {
    EXPECT_EQ(input.value("misbehaved", 0), 0) << input.dump();
    for (const auto& connection : input["connections"]) {
      std::uint64_t accounted = 0;
      for (const char* where : {"taken", "dropped", "overtaken", "waiting"}) {
        accounted += connection[where].get<std::uint64_t>();
      }
      EXPECT_EQ(connection["accepted"], accounted) << connection.dump();
    }
  }
  EXPECT_EQ(status["strangers"].size(), 0u) << status["strangers"].dump();
}

// Ports open and close, samples go through them, and another model comes into force.
void DaemonScene::require_another_round() {
  for (int i = 0; i < 2; ++i) {
    Node node("round");
    auto in = node.input_port<Number>("/again:i");
    auto out = node.output_port<Number>("/again:o");
    EXPECT_EQ(out.publish(Number{i}).delivered, 1u);
    EXPECT_EQ(take_from(in), i);
  }
  in_force_ = in_force_ == "a" ? "b" : "a";
  daemon_.load(model_of(in_force_));
  require_model_in_force();
  require_flow();
}

void DaemonScene::require_all_is_well() {
  restart();
  if (!node_) open_survivors();
  finish_asking();
  require_model_in_force();
  require_flow();
  require_one_writer();
  require_accounts_balance();
  require_another_round();
}

}  // namespace arbiter::test
