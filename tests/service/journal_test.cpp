// What arbiterd tells a journal: which line is about what, as fields.
#include "service/log/journal.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <set>
#include <sstream>

#include <arbiter/arbiter.hpp>

#include "logging/journal.hpp"
#include "logging/log_writer.hpp"
#include "service/log/log_sink.hpp"
#include "tests/client/component.hpp"
#include "tests/client/models.hpp"
#include "tests/client/samples.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/journal_socket.hpp"
#include "tests/support/raw_port.hpp"
#include "tests/support/text_files.hpp"

namespace arbiter::service {
namespace {

using logging::is_journal;
using logging::JournalSocket;
using logging::LogWriter;
using test::JournalRecord;
using test::JournalServer;
using test::TemporaryDirectory;
using testing::Contains;
using testing::HasSubstr;
using testing::Not;
using testing::Pair;
using testing::SizeIs;
using namespace std::chrono_literals;

// Where the text would go.
struct LogFile {
  LogFile() : fd(::open((directory.path() + "/log").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600)) {}
  [[nodiscard]] std::string content() const {
    std::string text(1 << 16, '\0');
    const ssize_t size = ::pread(fd.get(), text.data(), text.size(), 0);
    text.resize(size < 0 ? 0 : static_cast<std::size_t>(size));
    return text;
  }
  TemporaryDirectory directory;
  shm::FileDescriptor fd;
};

std::string stream_of(int fd) {
  struct stat status {};
  ::fstat(fd, &status);
  return std::to_string(status.st_dev) + ":" + std::to_string(status.st_ino);
}

TEST(Journal, IsWhereStandardErrorLeadsToTheStreamOfTheServiceManager) {
  const LogFile one;
  const LogFile other;
  EXPECT_TRUE(is_journal(one.fd.get(), stream_of(one.fd.get()).c_str()));
  EXPECT_FALSE(is_journal(one.fd.get(), stream_of(other.fd.get()).c_str()));  // redirected since
  EXPECT_FALSE(is_journal(one.fd.get(), nullptr));
  for (const std::string wrong : {"", ":", "x", "8:"}) {
    EXPECT_FALSE(is_journal(one.fd.get(), wrong.c_str())) << wrong;
  }
  EXPECT_FALSE(is_journal(one.fd.get(), (stream_of(one.fd.get()) + " ").c_str()));
  EXPECT_FALSE(is_journal(-1, "0:0"));
}

TEST(Journal, HasEachLineWithWhatItIsAbout) {
  const LogFile file;
  JournalServer journal(file.directory.path() + "/journal");
  {
    log::logger logger("test", std::make_shared<LogSink>(std::make_shared<LogWriter>(
                                   file.fd.get(), JournalSocket(journal.path()))));
    const LogAccount account(1234);
    const Event event{EventKind::kMismatch, {"nav", "base"}, {"/Nav/cmd:o"}, {"/Base/cmd:i"}, 7};
    {
      const EventScope scope(event);
      logger.warn("{} is not connected", "/Nav/cmd:o");
    }
    logger.error("about nothing");
  }
  const auto records = journal.rest();
  ASSERT_THAT(records, SizeIs(2));
  EXPECT_EQ(records[0], (JournalRecord{{"MESSAGE", "/Nav/cmd:o is not connected"},
                                       {"PRIORITY", "4"},
                                       {"SYSLOG_IDENTIFIER", "arbiterd"},
                                       {"MESSAGE_ID", event_names.at(11).message_id},
                                       {"ARBITER_EVENT", "mismatch"},
                                       {"ARBITER_USER", "1234"},
                                       {"ARBITER_GENERATION", "7"},
                                       {"ARBITER_COMPONENT", "nav"},
                                       {"ARBITER_COMPONENT", "base"},
                                       {"ARBITER_SOURCE", "/Nav/cmd:o"},
                                       {"ARBITER_PORT", "/Base/cmd:i"}}));
  EXPECT_EQ(records[1], (JournalRecord{{"MESSAGE", "about nothing"},
                                       {"PRIORITY", "3"},
                                       {"SYSLOG_IDENTIFIER", "arbiterd"},
                                       {"ARBITER_USER", "1234"}}));
  EXPECT_EQ(file.content(), "");
}

TEST(Journal, NamesForgeNoFieldAndFillNoRecord) {
  const std::string forged = "x\nARBITER_PORT=/Arm/pos:i\n";
  const std::string name(255, 'y');
  const Event event{EventKind::kDied, {forged}, {}, std::vector<std::string_view>(1000, name)};
  const std::string bytes = journal_record(forged, log::level::info, &event, {});
  const auto record = test::parse_journal_record(bytes);
  EXPECT_EQ(record.find("MESSAGE")->second, "x\\nARBITER_PORT=/Arm/pos:i\\n");
  EXPECT_EQ(record.find("ARBITER_COMPONENT")->second, "x\\nARBITER_PORT=/Arm/pos:i\\n");
  EXPECT_THAT(record, Not(Contains(Pair("ARBITER_PORT", "/Arm/pos:i"))));
  EXPECT_GE(record.count("ARBITER_PORT"), 10u);
  EXPECT_LT(bytes.size(), 2 * kMaxNamesInRecord);
}

TEST(Journal, ThatDoesNotTakeARecordIsGivenTheLineAsText) {
  const LogFile file;
  {
    LogWriter writer(file.fd.get(), JournalSocket(file.directory.path() + "/nobody"));
    writer.put("line\n", journal_record("line", log::level::info, nullptr, {}));
  }
  EXPECT_EQ(file.content(), "line\n");
}

TEST(Journal, ThatNobodyReadsHoldsNobodyUpAndSaysWhatItLost) {
  const LogFile file;
  JournalServer journal(file.directory.path() + "/journal");
  LogWriter writer(file.fd.get(), JournalSocket(journal.path()));
  const std::string line(1000, 'x');
  const std::string record = journal_record(line, log::level::info, nullptr, {});
  std::size_t put = 0;
  for (; put < 4 * LogWriter::kMaxWaiting / line.size(); ++put) writer.put(line + "\n", record);
  EXPECT_FALSE(writer.finish(0ms));  // the last of them still waits: the journal is full
  std::size_t written = 0;
  std::size_t lost = 0;
  while (written + lost < put) {
    const std::string message = journal.receive().find("MESSAGE")->second;
    if (message == line) {
      ++written;
      continue;
    }
    EXPECT_THAT(message, HasSubstr(" lines were lost here"));
    lost += std::stoul(message);
  }
  EXPECT_EQ(written + lost, put);
  EXPECT_GT(lost, 0u);
}

TEST(Journal, EachKindOfEventHasItsNameAndItsId) {
  std::set<std::string> names, ids;
  for (std::size_t i = 0; i < event_names.size(); ++i) {
    const EventName& each = event_names.at(i);
    EXPECT_EQ(static_cast<std::size_t>(each.kind), i);
    EXPECT_TRUE(names.insert(each.name).second) << each.name;
    const std::string id = each.message_id;
    EXPECT_TRUE(ids.insert(id).second) << id;
    EXPECT_EQ(id.size(), 32u);
    EXPECT_EQ(id.find_first_not_of("0123456789abcdef"), std::string::npos);
  }
}

// Each field and each event has a row of docs/log.md, and each row is one of them.
TEST(Journal, IsAsThePageSays) {
  const std::string page = test::content_of(std::string(ARBITER_TEST_DATA) + "/../../docs/log.md");
  const auto rows_below = [&](const std::string& heading) {
    const std::size_t begin = page.find("\n## " + heading + "\n");
    std::istringstream section(page.substr(begin, page.find("\n## ", begin + 1) - begin));
    std::vector<std::string> rows;
    for (std::string line; std::getline(section, line);) {
      if (line.starts_with("| `")) rows.push_back(line);
    }
    return rows;
  };
  const Event event{EventKind::kDied, {"a"}, {"/b"}, {"/c"}, 1};
  std::multiset<std::string> fields;
  for (const auto& [name, value] :
       test::parse_journal_record(journal_record("", log::level::info, &event, 1))) {
    fields.insert("| `" + name + "` |");
  }
  std::multiset<std::string> documented;
  for (const std::string& row : rows_below("Fields")) {
    documented.insert(row.substr(0, row.find('|', 1) + 1));
  }
  EXPECT_EQ(documented, fields);
  const auto events = rows_below("Events");
  ASSERT_EQ(events.size(), event_names.size());
  for (std::size_t i = 0; i < event_names.size(); ++i) {
    const std::string name = event_names.at(i).name;
    const std::string id = event_names.at(i).message_id;
    EXPECT_THAT(events[i], testing::StartsWith("| `" + name + "` | `" + id + "` | "));
  }
}

}  // namespace
}  // namespace arbiter::service

namespace arbiter::test {
namespace {

using testing::HasSubstr;
using testing::IsSupersetOf;

// The service manager's part: standard error, here a file, is said to be the journal's stream.
const std::vector<std::string> kAsService = {
    "/bin/bash", "-c",
    "export JOURNAL_STREAM=$(stat -L -c %d:%i /dev/stderr) && exec \"$0\" \"$@\""};

JournalRecord about(std::initializer_list<JournalRecord::value_type> fields) { return fields; }

TEST(Journal, HasTheDaemonsEvents) {
  const TemporaryDirectory directory;
  JournalServer journal(directory.path() + "/journal");
  const ScopedVariable socket("ARBITER_JOURNAL_SOCKET", journal.path());
  const std::string model = rules(arbiter_at("/in", select("/out")));
  const std::string other = directory.write("other.xml", rules(arbiter_at("/in", select("/b"))));
  Daemon daemon(model, {.arguments = {"--model", "other=" + other}, .by = kAsService});
  const auto expect = [&](const std::string& event, const JournalRecord& fields) {
    const JournalRecord record = journal.wait_for(event, fields);
    EXPECT_EQ(record.count("MESSAGE_ID"), 1u);
  };
  expect("started", about({{"ARBITER_GENERATION", "1"}}));
  expect("ready", {});
  NodeOptions quiet;
  quiet.on_notice = [](const Notice&) {};
  {
    Node node("arm", quiet);
    auto in = node.input_port<Number>("/in");
    expect("opened", about({{"ARBITER_COMPONENT", "arm"}, {"ARBITER_PORT", "/in"}}));
    Node wrong("nav", quiet);
    auto out = wrong.output_port("/out");
    expect("opened", about({{"ARBITER_COMPONENT", "nav"},
                            {"ARBITER_SOURCE", "/out"},
                            {"ARBITER_USER", std::to_string(::getuid())}}));
    expect("mismatch", about({{"ARBITER_COMPONENT", "arm"},
                              {"ARBITER_COMPONENT", "nav"},
                              {"ARBITER_SOURCE", "/out"},
                              {"ARBITER_PORT", "/in"}}));
    EXPECT_THROW((void)node.output_port<Number>("/out"), Error);
    expect("refused", about({{"ARBITER_COMPONENT", "arm"}, {"ARBITER_SOURCE", "/out"}}));
    auto stray = node.output_port<Number>("/stray");
    expect("unmentioned", about({{"ARBITER_SOURCE", "/stray"}}));
  }
  expect("closed", about({{"ARBITER_SOURCE", "/stray"}}));
  expect("closed", about({{"ARBITER_COMPONENT", "nav"}, {"ARBITER_SOURCE", "/out"}}));
  expect("closed", about({{"ARBITER_COMPONENT", "arm"}, {"ARBITER_PORT", "/in"}}));
  expect("left", about({{"ARBITER_COMPONENT", "arm"}, {"PRIORITY", "6"}}));
  {
    RawClient asking(daemon.instance());  // a tool, whose calls are no news
    asking.hello("tool");
  }
  expect("left", about({{"ARBITER_COMPONENT", "tool"}, {"PRIORITY", "7"}}));
  daemon.load(rules(arbiter_at("/in", select("/new"))));
  expect("reloaded", about({{"ARBITER_GENERATION", "2"}}));
  daemon.load_bad("<behaviors><wrong/></behaviors>");
  expect("change-refused", about({{"ARBITER_GENERATION", "2"}, {"PRIORITY", "3"}}));
  RawClient operating(daemon.instance());
  operating.hello("operator");
  operating.send(RawClient::message(wire::MessageKind::kSwitch, "other"));
  expect("switched", about({{"ARBITER_GENERATION", "3"}}));
  operating.expect(wire::MessageKind::kDone);
  operating.send(RawClient::message(wire::MessageKind::kRollback, ""));
  expect("rolled-back", about({{"ARBITER_GENERATION", "4"}}));
  operating.expect(wire::MessageKind::kDone);
  EXPECT_EQ(daemon.terminate(), 0);
  expect("stopping", {});
  EXPECT_EQ(daemon.log(), "");
}

TEST(Journal, HasTheDeathOfAComponentUnderThePortsThatItHad) {
  const TemporaryDirectory directory;
  JournalServer journal(directory.path() + "/journal");
  const ScopedVariable socket("ARBITER_JOURNAL_SOCKET", journal.path());
  Daemon daemon(rules(arbiter_at("/in", select("/out"))), {.by = kAsService});
  Component component("victim");
  ASSERT_EQ(component.tell("output /out"), "open");
  component.kill();
  const JournalRecord died = journal.wait_for("died", about({{"ARBITER_SOURCE", "/out"}}));
  EXPECT_THAT(died, IsSupersetOf(about({{"ARBITER_COMPONENT", "victim"}})));
}

// A process closes its socket a moment before the kernel says that it has ended: the last word of
// it is that it has died, and never that it is away.
TEST(Journal, HasEachDeathOnceAndNobodyAwayWhoHasDied) {
  const TemporaryDirectory directory;
  JournalServer journal(directory.path() + "/journal");
  const ScopedVariable socket("ARBITER_JOURNAL_SOCKET", journal.path());
  Daemon daemon(rules(arbiter_at("/in", select("/out"))), {.by = kAsService});
  std::multiset<std::string> expected, told;
  const auto note_end = [&](const JournalRecord& record) {
    const std::string event =
        record.contains("ARBITER_EVENT") ? record.find("ARBITER_EVENT")->second : std::string();
    if (event != "away" && event != "died" && event != "left") return false;
    told.insert(record.find("PRIORITY")->second + ' ' + event + ": " +
                record.find("MESSAGE")->second);
    return event == "died";
  };
  for (int i = 0; i < 20; ++i) {
    Component component("victim");
    ASSERT_EQ(component.tell("output /out"), "open");
    const bool has_two = i % 2 != 0;
    if (has_two) {
      ASSERT_EQ(component.tell("input /in"), "open");
    }
    expected.insert("4 died: node \"victim\" (pid " + std::to_string(component.process().pid()) +
                    ") died with " + (has_two ? "2 ports" : "/out") + " open");
    component.kill();
    while (!note_end(journal.receive())) {
    }
  }
  EXPECT_EQ(daemon.terminate(), 0);
  for (const JournalRecord& record : journal.rest()) note_end(record);
  EXPECT_EQ(told, expected);
}

// Its process goes on, and may come back.
TEST(Journal, SaysOfWhoeverIsAwayThatItsPortsAreKept) {
  const TemporaryDirectory directory;
  JournalServer journal(directory.path() + "/journal");
  const ScopedVariable socket("ARBITER_JOURNAL_SOCKET", journal.path());
  Daemon daemon(rules(arbiter_at("/in", select("/out"))), {.by = kAsService});
  const std::string pid = std::to_string(::getpid());
  const auto hang_up = [&](const std::string& name, const std::vector<std::string>& ports) {
    RawClient client(daemon.instance());
    client.hello(name, wire::kComesBack);
    for (const std::string& port : ports) open_raw_output(client, port, raw_output_segment());
  };
  const auto text_of = [&](const std::string& name) {
    const JournalRecord record = journal.wait_for("away", about({{"ARBITER_COMPONENT", name}}));
    return record.find("PRIORITY")->second + ' ' + record.find("MESSAGE")->second;
  };
  hang_up("one", {"/out"});
  EXPECT_EQ(text_of("one"),
            "6 node \"one\" (pid " + pid + ") is away; its port /out is kept for it");
  hang_up("two", {"/a", "/b"});
  EXPECT_EQ(text_of("two"),
            "6 node \"two\" (pid " + pid + ") is away; its 2 ports are kept for it");
}

TEST(Journal, IsNotTakenForOneWithoutTheServiceManagersWord) {
  const TemporaryDirectory directory;
  JournalServer journal(directory.path() + "/journal");
  const ScopedVariable socket("ARBITER_JOURNAL_SOCKET", journal.path());
  const ScopedVariable stream("JOURNAL_STREAM", "1:1");  // of whoever started the tests
  Daemon daemon;
  EXPECT_THAT(daemon.log(), HasSubstr("is ready at"));
  EXPECT_TRUE(journal.rest().empty());
}

}  // namespace
}  // namespace arbiter::test
