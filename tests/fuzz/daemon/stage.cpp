#include "tests/fuzz/daemon/stage.hpp"

#include <dirent.h>
#include <spdlog/sinks/null_sink.h>
#include <unistd.h>

#include <nlohmann/json.hpp>

#include "service/log/log.hpp"
#include "tests/fuzz/fuzz.hpp"
#include "wire/errands.hpp"

namespace arbiter::fuzz {
namespace {

// The models take turns. Both connect /low and /high to /in; the hostile ones may have any other
// end.
constexpr const char* kModels[] = {
    "<behaviors timeout='1s'><arbiter at='/in'><select from='/low'>not /high</select>"
    "<select from='/high'>not /stop</select></arbiter>"
    "<arbiter at='/other'><select from='/low'/></arbiter>"
    "<arbiter at='/b'><select from='/a'/></arbiter></behaviors>",
    "<behaviors><arbiter at='/in'><select from='/low'>not /high and not /third</select>"
    "<select from='/high'/></arbiter>"
    "<arbiter at='/b'><select from='/a'/></arbiter></behaviors>"};

// What the daemon grants to those who are slow, and some more.
constexpr shm::Nanoseconds kMostTime = service::kMaxWaitForClients + 50'000'000;

// Messages are made up as they are in life, and go nowhere.
void log_to_nobody() {
  auto logger =
      std::make_shared<spdlog::logger>("fuzz", std::make_shared<spdlog::sinks::null_sink_st>());
  logger->set_level(spdlog::level::debug);
  service::log::set_default_logger(std::move(logger));
}

}  // namespace

// Those aside that the daemon leaves to threads to close: nothing here keeps them waiting.
std::size_t count_descriptors() {
  require(wire::Errands::of_the_process().wait_until_done(60'000'000'000),
          "what is closed elsewhere is closed");
  std::size_t count = 0;
  DIR* const listing = ::opendir("/proc/self/fd");
  require(listing != nullptr, "descriptors can be listed");
  while (::readdir(listing) != nullptr) ++count;
  ::closedir(listing);
  return count;
}

Stage::Stage() : owner_(::getpid(), ::geteuid()) {
  static const bool logs_to_nobody = (log_to_nobody(), true);
  static_cast<void>(logs_to_nobody);
  Loop::now = 1'000'000'000;
  write_model(0);
  service::DaemonOptions options;
  options.models = {{"one", {{directory_.path() + "/model.xml"}, {}}},
                    {"other", {{directory_.write("other.xml", kModels[1])}, {}}}};
  options.instance = "fuzz";
  options.directory = directory_.path();
  options.compiles_in = service::Compiler::Thread::kOfCaller;
  daemon_ = std::make_unique<service::Daemon>(options);
  sender_ = std::make_unique<Honest>(path(), owner_, "sender");
  run();
  sender_->open_output("/low");
  receiver_ = std::make_unique<Honest>(path(), owner_, "receiver");
  run();
  receiver_->open_input("/in");
  run();
  require(sender_->is_connected() && receiver_->is_connected(), "ports open");
  sources_ = count_sources();
  // The one copy of the model's texts that the daemon keeps once somebody has asked for it.
  sender_->ask(wire::MessageKind::kModel);
  run();
  descriptors_ = count_descriptors();
}

void Stage::write_model(int number) {
  directory_.write("model.xml", kModels[number]);
  model_ = number;
}

void Stage::run_daemon() {
  Loop::rounds = 0;
  Loop::was_told_to_return = false;
  daemon_->run(loop_.signals());
  require(Loop::was_told_to_return, "only its owner stops the daemon");
}

void Stage::run(shm::Nanoseconds time) {
  Loop::may_pass = time;
  bool heard = true;
  while (heard) {
    run_daemon();
    heard = sender_->read();
    if (receiver_) heard |= receiver_->read();
    if (newcomer_) heard |= newcomer_->read();
  }
  Loop::now += std::exchange(Loop::may_pass, 0);
}

void Stage::reload() {
  write_model(1 - model_);
  const std::uint64_t before = sender_->done();
  sender_->ask(wire::MessageKind::kReload);
  run();
  run(kMostTime);
  require(sender_->done() == before + 1, "a model comes into force");
}

void Stage::switch_model() {
  const std::uint64_t before = sender_->done();
  is_other_ = !is_other_;
  sender_->ask(wire::MessageKind::kSwitch, is_other_ ? "other" : "one");
  run();
  run(kMostTime);
  require(sender_->done() == before + 1, "a model is switched to");
}

void Stage::roll_back() {
  const std::uint64_t before = sender_->done();
  sender_->ask(wire::MessageKind::kRollback);
  run();
  run(kMostTime);
  require((sender_->done() == before + 1) == sender_->refusal().empty(),
          "a rollback is made, or refused");
  sender_->ask(wire::MessageKind::kStatus);
  run();
  is_other_ = nlohmann::json::parse(sender_->status())["model"]["name"] == "other";
}

void Stage::serve_newcomer() {
  Process process(::getpid(), ::geteuid());
  newcomer_ = std::make_unique<Honest>(path(), process, "newcomer");
  run();
  require(newcomer_->is_welcome(), "a newcomer is welcomed");
  newcomer_->open_output("/newcomer");
  run();
  run(kMostTime);
  require(newcomer_->is_connected(), "a newcomer gets its port");
  newcomer_->close_port();
  run();
  newcomer_->open_input("/newcomer");
  run();
  run(kMostTime);
  require(newcomer_->is_connected(), "a newcomer gets its port");
  newcomer_.reset();
  run();
  process.end();
  run();
  require_status();
}

void Stage::require_status() {
  sender_->ask(wire::MessageKind::kStatus);
  run();
  const auto status = nlohmann::json::parse(sender_->status());
  require(status["model"]["reloads_refused"] == 0, "good models are not refused");
  for (const auto& source : status["sources"]) {
    if (source["name"] != "/low") continue;
    require(source["open"] == true && source["component"]["node"] == "sender", "/low stays open");
  }
  for (const auto& input : status["inputs"]) {
    if (input["name"] != "/in") continue;
    require(input["open"] == true && input["component"]["node"] == "receiver", "/in stays open");
    require(input["connections"][0]["source"] == "/low" &&
                input["connections"][0]["state"] == "connected",
            "/low and /in stay connected");
  }
  require(sender_->peers().count(receiver_->port()) == 1 &&
              receiver_->peers().count(sender_->port()) == 1,
          "/low and /in know each other");
}

std::size_t Stage::count_sources() {
  Process process(::getpid(), ::geteuid());
  newcomer_ = std::make_unique<Honest>(path(), process, "observer");
  run();
  newcomer_->ask(wire::MessageKind::kObserve);
  run();
  require(newcomer_->done() == 1, "an observer is told all");
  const std::size_t count = newcomer_->pages();
  newcomer_.reset();
  run();
  process.end();
  run();
  return count;
}

void Stage::require_as_before() {
  serve_newcomer();
  const auto status = nlohmann::json::parse(sender_->status());
  require(status["clients"] == 2, "no client is left behind");
  for (const auto& source : status["sources"]) {
    require(source["away"] == false, "no port is kept for the dead");
    require(source["open"] == (source["name"] == "/low"), "no port is left open");
  }
  for (const auto& input : status["inputs"]) {
    require(input["away"] == false, "no port is kept for the dead");
    require(input["open"] == (input["name"] == "/in"), "no port is left open");
  }
  require(sender_->peers().size() == 1 && receiver_->peers().size() == 1,
          "each has one peer, as before");
  const std::size_t named = count_sources() - sources_;
  // What clients have left unread is looked at once a second, and the kernel lets go of it when its
  // own thread comes round.
  const std::size_t expected = descriptors_ + 2 * named;
  std::size_t looks = 0;
  while (count_descriptors() != expected) {
    require(++looks < 1000, "no descriptor is left behind");
    run(1'100'000'000);
  }
}

}  // namespace arbiter::fuzz
