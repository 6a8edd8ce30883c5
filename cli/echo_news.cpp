#include "cli/echo_news.hpp"

#include <chrono>
#include <iostream>
#include <optional>

#include "wire/call.hpp"

namespace arbiter::cli {

EchoNews::EchoNews(const std::string& instance, std::string port) : port_(std::move(port)) {
  try {
    instance_ = watch_instance("echo", instance);
    models_.note(ModelNews::in_force(*instance_));
  } catch (const wire::RefusedError&) {  // by the policy
  }
}

void EchoNews::tell() {
  if (instance_ == nullptr) return;
  instance_->update();
  daemon_.tell(*instance_);
  tell_of_model();
}

void EchoNews::tell_of_model() {
  const auto model = models_.unknown(*instance_);
  if (!model || model->generation == 0) return;
  try {
    instance_->catch_up(std::chrono::seconds(1));  // its names may not have come yet
  } catch (const wire::CallError&) {               // it has gone, or is busy
    models_.put_off();
    return;
  }
  models_.note(*model);
  if (is_mentioned(*model->memory)) return;
  std::cerr << "arbiter: warning: model " << model->generation
            << ", which is in force now, does not mention " << port_ << '\n';
}

bool EchoNews::is_mentioned(const shm::DecisionMemory& memory) const {
  const auto table = memory.tables().snapshot().table;
  const auto source = instance_->find_source(port_);
  const auto port = instance_->find_port(port_);
  return (source && table.knows_source(*source)) || (port && table.knows_port(*port));
}

}  // namespace arbiter::cli
