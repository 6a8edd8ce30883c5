// docs/protocol.md against wire/messages.hpp, and against what a real daemon says.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>

#include <arbiter/arbiter.hpp>

#include "tests/client/models.hpp"
#include "tests/client/samples.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/documented_fields.hpp"
#include "tests/support/listener.hpp"
#include "tests/support/text_files.hpp"

namespace arbiter::test {
namespace {

using nlohmann::json;
using testing::IsEmpty;
using wire::MessageKind;

std::string protocol_page() { return source_of("docs/protocol.md"); }

const std::vector<std::string> kFromClient{"kind",        "number", "what it says", "fields",
                                           "descriptors", "needs",  "answered by"};
const std::vector<std::string> kFromDaemon{"kind", "number", "what it says", "fields",
                                           "descriptors"};

Numbers numbers_of(const std::vector<PageRow>& rows) {
  Numbers numbers;
  for (const PageRow& row : rows) {
    const auto number = static_cast<std::uint32_t>(std::stoul(row.cells.at(1)));
    EXPECT_TRUE(numbers.emplace(quoted(row.cells.at(0)).at(0), number).second) << row.line;
  }
  return numbers;
}

TEST(ProtocolPage, HasEachKindOfMessageUnderWhoSendsIt) {
  Numbers of_client, of_daemon;
  for (const auto& [name, number] : kinds_of_header()) {
    (number < static_cast<std::uint32_t>(MessageKind::kWelcome) ? of_client : of_daemon)[name] =
        number;
  }
  EXPECT_EQ(of_client["kHello"], static_cast<std::uint32_t>(MessageKind::kHello));
  EXPECT_EQ(of_client["kBlind"], static_cast<std::uint32_t>(MessageKind::kBlind));
  EXPECT_EQ(of_daemon["kUnmentioned"], static_cast<std::uint32_t>(MessageKind::kUnmentioned));
  EXPECT_EQ(numbers_of(rows_of(protocol_page(), kFromClient)), of_client);
  EXPECT_EQ(numbers_of(rows_of(protocol_page(), kFromDaemon)), of_daemon);
}

TEST(ProtocolPage, HasEachFlagAndTheVersion) {
  Numbers flags;
  for (const PageRow& row : rows_of(protocol_page(), {"flag", "value", "of", "meaning"})) {
    flags[quoted(row.cells[0]).at(0)] = static_cast<std::uint32_t>(std::stoul(row.cells[1]));
  }
  EXPECT_EQ(flags, enumerators(source_of("wire/messages.hpp"), "MessageFlag"));
  EXPECT_THAT(protocol_page(),
              testing::HasSubstr("It describes version " + std::to_string(wire::kWireVersion) +
                                 " (`kWireVersion`)"));
}

TEST(ProtocolPage, SaysWhereEachFieldOfAMessageLies) {
  using Message = wire::Message;
  using Place = std::pair<std::size_t, std::size_t>;
  const std::map<std::string, Place> places{
      {"kind", {offsetof(Message, kind), sizeof Message::kind}},
      {"flags", {offsetof(Message, flags), sizeof Message::flags}},
      {"request", {offsetof(Message, request), sizeof Message::request}},
      {"port", {offsetof(Message, port), sizeof Message::port}},
      {"peer", {offsetof(Message, peer), sizeof Message::peer}},
      {"link", {offsetof(Message, link), sizeof Message::link}},
      {"id", {offsetof(Message, id), sizeof Message::id}},
      {"value", {offsetof(Message, value), sizeof Message::value}},
      {"type", {offsetof(Message, type), sizeof Message::type}},
      {"name", {offsetof(Message, name), sizeof Message::name}},
      {"text", {offsetof(Message, text), sizeof Message::text}}};
  std::map<std::string, Place> on_page;
  for (const PageRow& row : rows_of(protocol_page(), {"field", "offset", "bytes", "what it is"})) {
    on_page[quoted(row.cells[0]).at(0)] = {std::stoul(row.cells[1]), std::stoul(row.cells[2])};
  }
  EXPECT_EQ(on_page, places);
  std::size_t bytes = 0;
  for (const auto& [name, place] : places) bytes += place.second;
  EXPECT_EQ(bytes, sizeof(Message)) << "the table lacks a field";
}

// Whether the words stand there, and are not a part of longer ones: `= 25` is not in `= 256`.
bool has_words(const std::string& source, const std::string& words) {
  const auto is_in_word = [](unsigned char c) { return std::isalnum(c) != 0 || c == '\''; };
  for (auto at = source.find(words); at != std::string::npos; at = source.find(words, at + 1)) {
    const auto end = at + words.size();
    if (at == 0 || end == source.size()) continue;
    if (!is_in_word(static_cast<unsigned char>(source[at - 1])) &&
        !is_in_word(static_cast<unsigned char>(source[end]))) {
      return true;
    }
  }
  return false;
}

// "kName = 3" and its like, as it stands in the file that the row names.
TEST(ProtocolPage, HasTheBoundsAndVersionsOfTheCode) {
  std::size_t count = 0;
  const auto check = [&](const std::string& words, const std::string& file) {
    const std::string source = source_of(quoted(file).at(0));
    for (const std::string& each : quoted(words)) {
      EXPECT_TRUE(has_words(source, each)) << each << " is not in " << file;
      ++count;
    }
  };
  for (const PageRow& row :
       rows_of(protocol_page(), {"bound", "of what", "in the code", "where"})) {
    check(row.cells[2], row.cells[3]);
  }
  for (const PageRow& row : rows_of(protocol_page(), {"segment", "made by", "written by", "read by",
                                                      "holds", "declared in", "version"})) {
    check(row.cells[6], row.cells[5]);
  }
  EXPECT_GT(count, 25u);
  EXPECT_FALSE(has_words("int kMax = 256;", "kMax = 25"));
  EXPECT_FALSE(has_words("int kMax = 256;", "Max = 256"));
}

std::map<std::string, Words> documented_answers() {
  std::map<std::string, Words> answers;
  for (const PageRow& row : rows_of(protocol_page(), kFromClient)) {
    const auto kinds = quoted(row.cells.at(6));
    answers[quoted(row.cells[0]).at(0)] = Words(kinds.begin(), kinds.end());
  }
  return answers;
}

TEST(ProtocolPage, SaysWhatAnswersWhat) {
  Daemon daemon(single_model());
  std::map<std::string, Words> answers;
  Listener client(daemon);
  const auto note = [&](MessageKind kind, Words kinds) { answers[name_of(kind)].merge(kinds); };
  note(MessageKind::kHello, client.hello());
  note(MessageKind::kOpenOutput, client.open_output("/out"));
  note(MessageKind::kOpenInput, client.open_input("/in"));
  auto connect = RawClient::message(MessageKind::kConnect);
  connect.port = client.last_opened();
  note(MessageKind::kConnect, client.ask(connect));
  note(MessageKind::kOpenTap, client.open_tap("/out"));
  for (const MessageKind kind :
       {MessageKind::kStatus, MessageKind::kModel, MessageKind::kObserve}) {
    note(kind, client.ask(kind));
  }
  note(MessageKind::kMay, client.ask(MessageKind::kMay, "observe"));
  daemon.write_model(override_model());
  for (const MessageKind kind :
       {MessageKind::kReload, MessageKind::kSwitch, MessageKind::kRollback}) {
    note(kind, client.ask(kind, "default"));
    note(kind, client.ask(kind, "default", wire::kWantsReport));
  }
  note(MessageKind::kDeactivate, client.ask(MessageKind::kDeactivate, "/low"));
  for (const MessageKind kind :
       {MessageKind::kClosePort, MessageKind::kSynced, MessageKind::kPeerRefused,
        MessageKind::kHandBackLink, MessageKind::kHandedBack, MessageKind::kBlind,
        MessageKind::kTapped, MessageKind::kDescribe, MessageKind::kNodeEnded}) {
    note(kind, client.say(kind));
  }
  // To nobody who has lost no daemon.
  for (const MessageKind kind :
       {MessageKind::kHandBackPage, MessageKind::kHandBackOutput, MessageKind::kHandBackInput}) {
    EXPECT_EQ(client.say(kind), Words{"kRefused"});
    note(kind, {});
  }
  note(MessageKind::kStop, client.ask(MessageKind::kStop));
  EXPECT_EQ(daemon.process().wait(), 0);
  EXPECT_EQ(answers, documented_answers());
}

// Each message is sent to daemons of which each forbids one action, and allows all others.
TEST(ProtocolPage, SaysWhatThePolicyMustAllow) {
  const auto numbers = kinds_of_header();
  const auto rows = rows_of(protocol_page(), kFromClient);
  for (const std::string action :
       {"output", "input", "deactivate", "tap", "observe", "reload", "switch", "stop"}) {
    const bool has_ports =
        action == "output" || action == "input" || action == "deactivate" || action == "tap";
    const TemporaryDirectory files;
    const std::string policy = files.write(
        "policy", "deny everyone " + action + (has_ports ? " *" : "") + "\nallow everyone all\n");
    Daemon daemon(single_model(), {.arguments = {"--policy", policy}});
    Listener client(daemon);
    client.hello();
    for (const PageRow& row : rows) {
      const std::string kind = quoted(row.cells[0]).at(0);
      const bool is_forbidden = row.cells.at(5) == "`" + action + "`";
      const bool is_asked = row.cells.at(6) != "—" && kind != "kHello";
      if (!is_asked || (kind == "kStop" && !is_forbidden)) continue;
      client.ask(static_cast<MessageKind>(numbers.at(kind)), "/out");
      const std::string answer(client.last_answer().text_view());
      EXPECT_EQ(answer.find(" may not ") != std::string::npos, is_forbidden)
          << kind << ", " << action << ": " << answer;
    }
  }
}

// A component that has connections in both directions, and hears of whatever there is to hear.
std::map<std::string, Heard> hear_all() {
  const auto first = [](const std::string& selects) {
    return "<arbiter at='/in' conflict='first'>" + selects + "</arbiter>";
  };
  const std::string mine =
      arbiter_at("/in-a", select("/mine")) + arbiter_at("/in-b", select("/mine"));
  const std::string mine_too = arbiter_at("/in-c", select("/mine"));
  const TemporaryDirectory files;
  const std::string policy =
      files.write("policy", "deny everyone replay /mine\nallow everyone all\n");
  Daemon daemon(rules(first(select("/out") + select("/other")) + mine + mine_too),
                {.arguments = {"--policy", policy}});
  Node node("peer", [] {
    NodeOptions options;
    options.on_notice = [](const Notice&) {};
    return options;
  }());
  auto out = std::make_optional(node.output_port<Number>("/out"));
  auto other = node.output_port<Number>("/other");
  auto takes_any = node.input_port("/in-a");
  auto takes_numbers = node.input_port<Number>("/in-b");
  auto takes_numbers_too = node.input_port<Number>("/in-c");
  Listener client(daemon);
  client.hello();
  client.open_input("/in");
  client.open_output("/mine");
  client.open_output("/may-be-replayed");
  client.open_output("/yields", wire::kYields);
  client.open_input("/unmentioned");
  for (int i = 0; i < 2; ++i) client.open_tap("/other");  // the second one's place is not 0
  client.open_tap("/out");
  client.open_tap("/in-a", wire::kTapsInput);
  client.open_tap("/in", wire::kTapsInput);
  out->signal();
  auto tap = node.tap("/in-c", {.of = TapOf::input});  // which the last model does not mention
  client.ask(MessageKind::kObserve);
  client.ask(MessageKind::kStatus);
  client.ask(MessageKind::kModel);
  client.ask(MessageKind::kSwitch, "no model");
  out.reset();
  client.hear(MessageKind::kPeerGone);
  {
    RawClient lost(daemon.instance());  // whose process lives
    lost.hello("lost", wire::kComesBack);
    const auto segment = raw_tap_segment();
    const shm::Bell bell;
    lost.send(RawClient::message(MessageKind::kOpenTap, "/mine"),
              {segment.get(), bell.for_publishers().get()});
    lost.expect(MessageKind::kOpened);
  }
  client.hear(MessageKind::kTapAway);
  {
    RawClient wants(daemon.instance());
    wants.hello("wants");
    const auto segment = raw_output_segment();
    wants.send(RawClient::message(MessageKind::kOpenOutput, "/yields"), {segment.get(), -1});
    client.hear(MessageKind::kYield);
  }
  daemon.write_model(rules(first(select("/out")) + mine));
  client.ask(MessageKind::kReload);
  client.ask(MessageKind::kReload, {}, wire::kWantsReport);
  return client.heard();
}

TEST(ProtocolPage, SaysWhichFieldsAndDescriptorsTheDaemonSends) {
  const auto all = hear_all();
  for (const PageRow& row : rows_of(protocol_page(), kFromDaemon)) {
    const std::string kind = quoted(row.cells[0]).at(0);
    const auto heard = all.find(kind);
    ASSERT_NE(heard, all.end()) << kind << " was never heard";
    const auto fields = quoted(row.cells.at(3));
    EXPECT_EQ(heard->second.fields, Words(fields.begin(), fields.end())) << kind;
    const std::string& descriptors = row.cells.at(4);
    if (descriptors == "—") continue;  // what comes all the same may be closed
    const auto count =
        static_cast<std::size_t>(std::count(descriptors.begin(), descriptors.end(), ',') + 1);
    std::set<std::size_t> counts{count};
    if (descriptors.starts_with("of an output port")) counts.insert(0);
    EXPECT_EQ(heard->second.descriptors, counts) << kind;
  }
}

// The document that answers kModel, of daemons that know the texts, or do not, or have no model.
json model_document(const Daemon& daemon) {
  RawClient client(daemon.instance());
  client.hello("model");
  client.send(RawClient::message(MessageKind::kModel));
  return read_document(client.expect(MessageKind::kModelReply));
}

TEST(ProtocolPage, NamesEachFieldOfTheModelDocumentAndNoOther) {
  ObservedFields observed({"ports_since_ns", "timeouts_before", "others[].ports"});
  const auto at = [](const std::string& port, const std::string& source) {
    return arbiter_at(port, select(source));
  };
  {
    const TemporaryDirectory files;
    const std::string other = files.write("other.xml", rules(at("/in", "/b")));
    // T of /a, of one that nobody changes, and of one that had none of its own.
    const auto model = [&](const std::string& sources) {
      return rules(sources + at("/in", "/a") + at("/in2", "/b") + at("/in3", "/c"));
    };
    Daemon daemon(model("<source port='/a' timeout='3s'/>"),
                  {.application = application(connection("/a", "/in") + connection("/b", "/in") +
                                              connection("/b", "/in2") + connection("/c", "/in3")),
                   .arguments = {"--model", "other=" + other}});
    observed.see(model_document(daemon));
    daemon.load(model("<source port='/a' timeout='1s'/><source port='/c' timeout='1s'/>"));
    observed.see(model_document(daemon));
    Listener client(daemon);
    client.hello();
    client.ask(MessageKind::kSwitch, "other");
    observed.see(model_document(daemon));
    Node node("test");
    auto out = node.output_port<Number>("/a");
    daemon.kill();
    daemon.restart_without_model();
    observed.see(model_document(daemon));
  }
  Daemon without("", {.without_model = true});
  observed.see(model_document(without));
  EXPECT_THAT(disagreements(protocol_page(), observed), IsEmpty());
}

}  // namespace
}  // namespace arbiter::test
