"""A page in the browser that shows a test while it runs, or a bag of one."""
