// All words of the pages of a class that the server does not send.

export const seconds = (time) => `${time.toFixed(1)} s`;

export const WORDS = {
  noLink: "Scan the code on the big screen, or open the link that your teacher gives you.",
  offline: "There is no connection. Your code is kept on this device, and this page goes on by itself.",
  crowded: "Your code is open in too many windows. Close some, then reload this page.",
  unknown: "This link is not known here. Join again, or ask your teacher for your own link.",
  saved: "saved", saving: "saving …", kept: "kept on this device", notStarted: "Not tried yet.", idle: "Press Try, and your robot plays here.", asking: "Getting ready …",
  queue: (place) => (place === 1 ? "You are next." : `You are number ${place} in the queue.`),
  halted: "Your teacher has paused all tries. Yours starts as soon as it goes on.",
  playing: "It plays …", watch: "Your last try. Press play to see it again.",
  reached: (time) => `Reached after ${seconds(time)}. Well done!`,
  error: ({ line, text }) => (line ? `Error in line ${line}: ${text}` : `Error: ${text}`),
  spoiled: (why) => `Not this time: ${why}.`,
  broken: (why) => `It ended early: ${why}.`,
  missed: "Not reached yet. Change something and try again.",
  won: (score) => `You win ${score}.`, lost: (score) => `The other team wins ${score}.`, draw: (score) => `A draw, ${score}.`,
  open: (score) => `Time is over at ${score}.`,
  next: (title) => `Next: ${title}`, seeCode: "Go to the line", free: "Free play",
  freeText: "Play the whole match, as it is played in the league. When you like how your robots play, press Hand in.",
  freeNoun: "Free play: the whole match", hint: "Show a hint", hintHeading: "Hint: ",
  step: (number, title, done) => `Step ${number}: ${title}${done ? ", done" : ""}`,
  stepOf: (number, count) => `Step ${number} of ${count}`,
  handed: (version) => `Version ${version} is handed in.`, notHanded: "Nothing handed in yet.",
  handedNow: (version) => `Handed in! Version ${version} plays in the league once two have handed in.`,
  noOutput: "What your code prints, its errors, and what the referee says appear here.",
  noView: "Press Try. Then this shows what your robot knows at each moment.",
  viewHelp: "Press a name to put it into your code.", robot: "Robot",
  inserted: (text) => `Put into your code: ${text}`,
  noBoard: "No games yet. Once two students have handed in, their robots play each other all the time.",
  watchGames: "Look at the games", waits: "waits", playsNot: (why) => `What you have handed in does not play: ${why}`,
  board: { place: "", name: "Name", rating: "Rating", games: "Games" },
  climbed: (places) => (places > 0 ? `▲ ${places}` : places < 0 ? `▼ ${-places}` : ""),
  climbedTitle: (places) => (places > 0 ? `climbed ${places}` : places < 0 ? `fell ${-places}` : ""),
  referee: "referee", lineAt: (line) => `line ${line}`, times: (count) => `× ${count}`,
  goTo: (time) => `Go to ${seconds(time)}`,
  play: "Play", pause: "Pause", back: "One step back", on: "One step on", toEnd: "To the end", time: "Time", speed: "Speed",
  copied: "Copied.", editor: "Your code. To leave it by keyboard, press Escape, then Tab.",
  field: "The field. Press one of your robots to see what it knows.",
};

export const PROJECTOR = {
  noLink: "Open the projector's link as it is printed where the class was started.",
  here: "Only this computer can open it: --listen 0.0.0.0 serves the class to others.",
  students: (count) => (count === 1 ? "1 student is here" : `${count} students have joined`),
  steps: (count) => (count === 1 ? "1 step done" : `${count} steps done together`),
  games: (count) => (count === 1 ? "1 game played" : `${count} games played`),
  halted: "Tries are paused", lost: "No connection to the computer of the class. Trying again …",
};

export const TEACHER = {
  noLink: "Open the teacher's link as it is printed where the class was started.",
  lost: "No connection to the computer of the class. What you see is old. Trying again …",
  status: (busy, jobs) => (busy ? `${busy} ${busy === 1 ? "try" : "tries"} running or waiting, ${jobs} at a time` : "No try is running"),
  unsealed: "The code of students is not shut in: it can do all that you can on this computer.",
  lacking: (what) => `This computer cannot shut code in: ${what}`,
  halt: "Pause all tries", goOn: "Let tries go on", sent: "Sent to everybody.", cleared: "The message is gone.",
  here: "here", away: "away", free: "free play", done: (count, all) => (all ? `${count} of ${all}` : `${count}`),
  none: "Nobody has joined yet. Show the projector's page, or the link of the class.",
  version: (number) => (number ? `version ${number}` : "–"), line: (line) => (line ? `line ${line}: ` : ""),
  count: (here, all) => `${here} of ${all} here`,
};

/** What the editor offers after a name and a dot, or where a word begins: [name, what it is]. */
export const OFFERS = {
  "view.me": [["name", "its name"], ["team", "its team"], ["role", "such as 'minnow'"], ["state", "such as 'active'"], ["may_move", "True while it may drive"], ["mark", "where it lines up, or None"], ["pose", "x, y, theta"]],
  "view.pose": [["x", "metres"], ["y", "metres"], ["theta", "heading, radians"]],
  "view.referee": [["clock", "time of play, s"], ["score", "points by team"], ["players", "all players"], ["zones", "all zones"], ["objects", "such as flags"], ["stage", "of the match"], ["winner", "or None"]],
  view: [
    ["position", "(x, y), metres"], ["pose", "x, y, theta"], ["time", "s"], ["speed", "metres a second"], ["me", "this player"],
    ["others()", "all other players"], ['zone("safe")', "a zone of the field"], ["referee", "clock, score, players"],
    ["velocities", "of others, by name"], ["readings", "of its sensors"], ["obstacles", "walls"], ["heard", "messages of the team"],
  ],
  self: [["name", "its name"], ["robot", "its robot"], ["seed", "for chance"]],
  math: [["hypot(x, y)", "length"], ["atan2(y, x)", "angle"], ["dist(a, b)", "distance of two points"], ["cos(a)", ""], ["sin(a)", ""], ["pi", ""], ["radians(a)", ""]],
  "": [["Twist(0.5, 0.0)", "ahead m/s, turn rad/s"], ["Action(Twist(0.5, 0.0))", "with a message"], ["STILL", "stand"], ["Pose", ""], ["Strategy", ""], ["View", ""], ["Sighting", ""], ["Stroke", ""], ["Planner", ""]],
};
