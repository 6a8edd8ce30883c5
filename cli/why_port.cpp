// What `arbiter why` says about the port itself: who wins, since when, and by which model.
#include <ostream>
#include <string>
#include <utility>

#include "cli/model_report.hpp"
#include "cli/why_answer.hpp"
#include "cli/why_elsewhere.hpp"
#include "cli/why_report.hpp"

namespace arbiter::cli {

using nlohmann::json;
using watch::ModelInForce;

void WhyAnswer::write_port() const {
  const ModelInForce& model = port_.model();
  out_ << port_.name();
  if (model.is_none()) {
    out_ << ": no model is in force, so no connection leads to it\n";
  } else if (!look_.is_mentioned) {
    out_ << ": the model in force does not mention it, so no connection leads to it\n";
  } else if (!look_.is_arbitrated) {
    out_ << ": not arbitrated, because no rule mentions it; everything that its connections "
            "bring is delivered\n";
  } else {
    const std::string useless =
        explanation_.winner ? obstacles_.why_it_cannot_deliver(*explanation_.winner) : "";
    out_ << ": "
         << (!useless.empty()      ? "idle, though " + *explanation_.winner + " is selected"
             : explanation_.winner ? *explanation_.winner + " wins"
                                   : std::string("idle, nobody wins"))
         << since_text();
    if (!useless.empty()) {
      out_ << "; it cannot deliver: " << useless;
    } else if (explanation_.winner) {
      const std::string why = obstacles_.why_nothing_comes_of(*explanation_.winner);
      if (!why.empty()) out_ << "; but nothing of it reaches the port: " << why;
    }
    out_ << '\n';
  }
  write_model();
  write_obstacles(out_, obstacles_.of_port());
  write_others_with_port(out_, port_.name(), is_open_, also_open_on_);
  if (!look_.picture.is_settled) {
    out_
        << "  ! sources change faster than they can be read: this answer may mix several moments\n";
  }
  if (look_.is_arbitrated && !model.has_texts() && !obstacles_.is_model_refused()) {
    out_ << "  ! the daemon took this model over from its predecessor (it was started without "
            "--model): it knows the decisions, but not the behaviours behind them\n";
  }
}

void WhyAnswer::write_model() const {
  const ModelInForce& model = port_.model();
  if (!model.is_none()) {
    out_ << "  by " << model.text() << origin_text(model, look_.sources.now()) << '\n';
  }
  for (const auto& file : model.files_now()) {
    const std::string advice = file_advice(file.state, model.is_older());
    if (!advice.empty()) out_ << "  ! " << file.path << advice << '\n';
  }
  if (look_.is_mentioned) return;
  if (const auto other = model.other_that_mentions(port_.name())) {
    out_ << "  ! model \"" << *other << "\" mentions it: arbiter switch " << *other << '\n';
  }
}

std::string WhyAnswer::since_text() const {
  const shm::Nanoseconds now = look_.sources.now();
  const ModelInForce& model = port_.model();
  if (tenure_.is_exact()) {
    return ", for " + span_text(now - tenure_.at_least) + ", since " +
           events_text(port_, tenure_.changed, look_, *tenure_.not_before);
  }
  const shm::Nanoseconds decided_since = model.since(port_.name());
  if (tenure_.at_least != 0 && tenure_.at_least == decided_since) {
    const std::string span = span_text(now - decided_since) + " ago";
    return decided_since == model.since()
               ? ", since model " + std::to_string(model.generation()) + " came into force " + span
               : ", since a model came into force " + span +
                     " that decides here as the one in force does";
  }
  std::string text;
  if (tenure_.at_least != 0) text += ", for at least " + span_text(now - tenure_.at_least);
  if (tenure_.not_before) {
    text += text.empty() ? ", for " : " and ";
    text += "at most " + span_text(now - *tenure_.not_before) + " (not before " +
            events_text(port_, tenure_.changed, look_, *tenure_.not_before) + ')';
  } else if (tenure_.at_least == 0) {
    text += ": nothing has ever happened here";
  }
  return text;
}

json WhyAnswer::since_json() const {
  json changed = json::array();
  for (const shm::SourceId source : tenure_.changed) {
    const std::string name = port_.source_name(source);
    changed.push_back(event_json(name, look_.sources.state(name), *tenure_.not_before));
  }
  return {{"exact", tenure_.is_exact()},
          {"at_least_ns", tenure_.at_least},
          {"not_before_ns", tenure_.not_before ? json(*tenure_.not_before) : json(nullptr)},
          {"changed", std::move(changed)}};
}

}  // namespace arbiter::cli
