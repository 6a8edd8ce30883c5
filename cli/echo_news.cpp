#include "cli/echo_news.hpp"

#include <iostream>
#include <optional>

#include "rules/text/names.hpp"
#include "shm/clock.hpp"
#include "wire/call.hpp"
#include "wire/rendezvous.hpp"

namespace arbiter::cli {
namespace {

// In steps, between which it hears Ctrl-C.
std::shared_ptr<watch::Instance> await_instance(const std::string& name,
                                                const shm::FileDescriptor& interrupts) {
  constexpr shm::Nanoseconds kStep = 1'000'000'000;  // what follow_instance() gives a daemon
  const shm::Nanoseconds give_up = shm::monotonic_now() + shm::Nanoseconds{5'000'000'000};
  for (bool has_said = false;;) {
    const shm::Nanoseconds asked = shm::monotonic_now();
    try {
      return follow_instance("echo", name);
    } catch (const wire::RefusedError&) {
      throw;
    } catch (const wire::CallError&) {
      const shm::Nanoseconds now = shm::monotonic_now();
      const bool is_there = now - asked >= kStep;
      if (!is_there || now >= give_up || sleep_until(now, interrupts)) throw;
    }
    if (std::exchange(has_said, true)) continue;
    std::cerr << "arbiter: waiting for the arbiterd of instance "
              << rules::quote(wire::instance_name(name)) << " to answer\n";
  }
}

}  // namespace

EchoNews::EchoNews(const std::string& instance, std::string port,
                   const shm::FileDescriptor& interrupts)
    : port_(std::move(port)) {
  try {
    instance_ = await_instance(instance, interrupts);
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
    instance_->catch_up();            // its names may not have come yet
  } catch (const wire::CallError&) {  // it has gone, or is busy
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
