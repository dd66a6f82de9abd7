"""The virtual machine: it runs compiled programs on thousands of environments at once and knows no names."""
