"""What tests share: courses, hosts, browsers, and readers of fixtures."""
