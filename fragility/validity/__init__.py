"""The validity screen: for each run the reasons why rocking may not be the right model of it."""
