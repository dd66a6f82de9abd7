"""The one shared recurrent PPO trainer: it learns any scenario through Gymnasium spaces and knows none by name."""
