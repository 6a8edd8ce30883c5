#include "cli/echo_news.hpp"

#include <exception>
#include <iostream>
#include <optional>

#include "shm/clock.hpp"

namespace arbiter::cli {

EchoNews::EchoNews(std::shared_ptr<watch::Instance> instance, std::string port)
    : instance_(std::move(instance)), port_(std::move(port)) {
  if (instance_ == nullptr) return;
  memory_ = instance_->memory();
  generation_ = memory_->tables().snapshot().generation;
}

void EchoNews::tell() {
  if (instance_ == nullptr) return;
  instance_->update();
  daemon_.tell(*instance_);
  tell_of_model();
}

void EchoNews::tell_of_model() {
  const auto memory = instance_->memory();
  const std::uint64_t generation = memory->tables().snapshot().generation;
  const bool is_known = memory == memory_ && generation == generation_;
  if (is_known || generation == 0 || !instance_->has_daemon()) return;
  if (shm::monotonic_now() < ask_again_) return;
  try {
    instance_->catch_up();            // its names may not have come yet
  } catch (const wire::CallError&) {  // it has gone, or is busy
    ask_again_ = shm::monotonic_now() + kAskAgainLater;
    return;
  }
  memory_ = memory;
  generation_ = generation;
  if (is_mentioned(*memory)) return;
  std::cerr << "arbiter: warning: model " << generation
            << ", which is in force now, does not mention " << port_ << '\n';
}

bool EchoNews::is_mentioned(const shm::DecisionMemory& memory) const {
  const auto table = memory.tables().snapshot().table;
  const auto source = instance_->find_source(port_);
  const auto port = instance_->find_port(port_);
  return (source && table.knows_source(*source)) || (port && table.knows_port(*port));
}

std::shared_ptr<watch::Instance> observe_for_echo(const std::string& instance) {
  try {
    return follow_instance("echo", instance);
  } catch (const std::exception&) {
    return nullptr;
  }
}

}  // namespace arbiter::cli
