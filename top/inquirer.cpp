#include "top/inquirer.hpp"

#include <sys/eventfd.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <exception>
#include <sstream>
#include <system_error>
#include <utility>

#include "shm/clock.hpp"
#include "top/signals_blocked.hpp"
#include "wire/call.hpp"

namespace arbiter::top {
namespace {

constexpr std::chrono::seconds kCensusInterval{1};

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

}  // namespace

Inquirer::Inquirer(std::shared_ptr<watch::Instance> instance, ExplainWhy explain)
    : instance_(std::move(instance)),
      models_(std::make_shared<watch::ModelLoader>(instance_)),
      explain_(std::move(explain)),
      bell_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  if (!bell_) throw std::system_error(errno, std::generic_category(), "eventfd");
  const SignalsBlocked blocked;
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

Inquirer::~Inquirer() {
  thread_.request_stop();
  thread_.join();
}

void Inquirer::ask(WhyQuestion question) {
  {
    const std::lock_guard lock(mutex_);
    question_ = std::move(question);
  }
  asked_.notify_one();
}

Inquirer::News Inquirer::take_news() {
  std::uint64_t rings = 0;
  static_cast<void>(!::read(bell_.get(), &rings, sizeof rings));
  const std::lock_guard lock(mutex_);
  News news = std::exchange(news_, {});
  news_.problem = news.problem;  // these hold until they are mended
  news_.is_silent = news.is_silent;
  return news;
}

void Inquirer::run(const std::stop_token& stop) {
  auto next = std::chrono::steady_clock::now();
  while (!stop.stop_requested()) {
    std::optional<WhyQuestion> question;
    {
      std::unique_lock lock(mutex_);
      asked_.wait_until(lock, stop, next, [this] { return question_.has_value(); });
      question = std::exchange(question_, std::nullopt);
    }
    if (stop.stop_requested()) return;
    if (question) answer(*question, stop);
    if (std::chrono::steady_clock::now() < next) continue;
    take_census();
    next = std::chrono::steady_clock::now() + kCensusInterval;
  }
}

void Inquirer::take_census() {
  StampedStatus now;
  now.asked = shm::monotonic_now();
  try {
    now.status = instance_->status();
  } catch (const std::exception& error) {
    const std::string problem = error.what();
    const bool is_silent = dynamic_cast<const wire::CallError*>(&error) != nullptr &&
                           dynamic_cast<const wire::RefusedError*>(&error) == nullptr;
    tell([&](News& news) {
      news.problem = problem;
      news.is_silent = is_silent;
    });
    return;
  }
  now.at = shm::monotonic_now();
  now.wall = std::chrono::system_clock::now();
  const auto census = std::make_shared<const Census>(census_of(now, last_ ? &*last_ : nullptr));
  last_ = std::move(now);
  tell([&](News& news) {
    news.census = census;
    news.problem.clear();
    news.is_silent = false;
  });
}

void Inquirer::answer(const WhyQuestion& question, const std::stop_token& stop) {
  WhyReply reply{question, {}};
  try {
    reply.lines = lines_of(explain_(instance_, models_, question, stop));
  } catch (const std::exception& error) {
    reply.lines = {error.what()};
  }
  tell([&](News& news) { news.why = std::move(reply); });
}

void Inquirer::tell(const std::function<void(News&)>& write) {
  {
    const std::lock_guard lock(mutex_);
    write(news_);
  }
  const std::uint64_t ring = 1;
  static_cast<void>(!::write(bell_.get(), &ring, sizeof ring));
}

}  // namespace arbiter::top
