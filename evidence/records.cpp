#include "evidence/records.hpp"

#include <algorithm>

namespace arbiter::evidence {
namespace {

template <class... F>
struct Overloaded : F... {
  using F::operator()...;
};
template <class... F>
Overloaded(F...) -> Overloaded<F...>;

}  // namespace

Nanoseconds time_of(const Record& record) {
  return std::visit(
      Overloaded{[](const PortChange& each) { return each.seen; },
                 [](const ModelChange& each) { return each.time == 0 ? each.seen : each.time; },
                 [](const Missed& each) { return each.to; },
                 [](const SourceState& each) { return each.seen; },
                 [](const DestinationsChange& each) { return each.seen; },
                 [](const auto& each) { return each.time; }},
      record);
}

const SourceContext* context_of(const Record& record) {
  return std::visit(
      [](const auto& each) -> const SourceContext* {
        if constexpr (requires { each.context; }) {
          return each.context.get();
        } else {
          return nullptr;
        }
      },
      record);
}

std::size_t size_of(const Record& record) {
  constexpr std::size_t kControl = 32;  // of the pointer to it, and its place in a list
  std::size_t size = sizeof(Record) + kControl + payload_size_of(record);
  if (const auto* model = std::get_if<ModelChange>(&record)) {
    for (const ModelFile& file : model->files) size += file.text.size();
    if (model->application) size += model->application->text.size();
  }
  return size;
}

std::size_t payload_size_of(const Record& record) {
  const auto* arrival = std::get_if<Arrival>(&record);
  return arrival == nullptr || !arrival->payload ? 0 : arrival->payload->capacity();
}

std::string_view name_of(SourceState::Why why) {
  switch (why) {
    case SourceState::Why::joined:
      return "joined";
    case SourceState::Why::gap:
      return "gap";
    case SourceState::Why::closed:
      return "closed";
    case SourceState::Why::page:
      break;
  }
  return "page";
}

std::string_view name_of(PortChange::What what) {
  switch (what) {
    case PortChange::What::opened:
      return "opened";
    case PortChange::What::closed:
      return "closed";
    case PortChange::What::died:
      return "died";
    case PortChange::What::open:
      break;
  }
  return "open";
}

std::string_view name_of(WinnerChange::Why why) {
  switch (why) {
    case WinnerChange::Why::arrival:
      return "arrival";
    case WinnerChange::Why::expiry:
      return "expiry";
    case WinnerChange::Why::deactivation:
      return "deactivation";
    case WinnerChange::Why::model:
      return "model";
    case WinnerChange::Why::state:
      return "state";
    case WinnerChange::Why::start:
      break;
  }
  return "start";
}

std::string_view name_of(Missed::Why why) {
  switch (why) {
    case Missed::Why::queue:
      return "queue";
    case Missed::Why::refused:
      return "refused";
    case Missed::Why::stranger:
      return "stranger";
    case Missed::Why::too_large:
      return "too_large";
    case Missed::Why::memory:
      return "memory";
    case Missed::Why::other:
      return "other";
    case Missed::Why::overtaken:
      break;
  }
  return "overtaken";
}

}  // namespace arbiter::evidence
